"""Curved surfaces as pixels: Lagrange triangles divided until their pieces are smaller than a few pixels, with a depth
buffer, smooth shading and outlines. numpy only: no display, no graphics library."""

import numpy as np

OVERSAMPLING = 2  # per pixel and direction
PIECE = 6.0  # longest side of a piece, in samples
MAX_PIECES = 128  # along the side of a cell
CHUNK = 400_000  # pieces at a time, to bound memory
SLACK = 0.02  # overlap of pieces relative to their size, so that rounding leaves no holes
RIM_SHADE = 0.4  # how much darker a surface is where it is seen edge-on
OUTLINE = 0.12  # grey level
JUMPS = 0.01, 0.03  # depth between neighbours, relative to the picture, where an outline begins and where it is black


def lattice(order):
    """Barycentric integers of the nodes of a cell in VTK's order, for orders 1 to 4."""
    k = order
    corners = [(k, 0, 0), (0, k, 0), (0, 0, k)]
    way = range(1, k)
    edges = [(k - i, i, 0) for i in way] + [(0, k - i, i) for i in way] + [(i, 0, k - i) for i in way]
    inside = {1: [], 2: [], 3: [(1, 1, 1)], 4: [(2, 1, 1), (1, 2, 1), (1, 1, 2)]}[k]
    return np.array(corners + edges + inside)


def lagrange(order, places):
    """The functions of the nodes (columns) at barycentric places (rows)."""
    at = order * np.asarray(places, float)
    out = np.ones((len(at), len(lattice(order))))
    for column, powers in enumerate(lattice(order)):
        for coordinate, power in enumerate(powers):
            for i in range(power):
                out[:, column] *= (at[:, coordinate] - i) / (power - i)
    return out


def division(n):
    """Barycentric corners of the n^2 pieces of a triangle, and three indices each, with the orientation of the triangle."""
    index = {(i, j): number for number, (i, j) in enumerate((i, j) for i in range(n + 1) for j in range(n + 1 - i))}
    places = np.array([((n - i - j) / n, i / n, j / n) for i, j in index])
    up = [(index[i, j], index[i + 1, j], index[i, j + 1]) for i in range(n) for j in range(n - i)]
    down = [(index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]) for i in range(n - 1) for j in range(n - 1 - i)]
    return places, np.array(up + down)


CAMERA = -37.0, 22.0  # azimuth and elevation in degrees


class View:
    """Parallel projection along a direction, the z axis upright."""

    def __init__(self, azimuth=CAMERA[0], elevation=CAMERA[1]):
        a, e = np.radians([azimuth, elevation])
        right = [-np.sin(a), np.cos(a), 0]
        up = [-np.cos(a) * np.sin(e), -np.sin(a) * np.sin(e), np.cos(e)]
        eye = [np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)]
        self.axes = np.array([right, up, eye]).T

    def extent(self, points):
        """Lower and upper corners of the picture of all points, in units of length."""
        seen = points @ self.axes[:, :2]
        return seen.min(axis=0), seen.max(axis=0)


class Samples:
    """The frontmost surface at each sample: whether there is one, its side, normal and values."""

    def __init__(self, width, height, values, closed):
        self.shape, self.closed = (height, width), closed  # the inside of a closed surface is invisible
        self.depth = np.full(height * width, -np.inf)
        self.outside = np.zeros(height * width, bool)
        self.normal = np.zeros((height * width, 3))
        self.values = np.zeros((height * width, values))

    def add(self, corners, normals, values):
        """Pieces: corners [n, 3, 3] as (right, down, depth) in samples; normals and values of each corner."""
        a, b, c = corners[:, 0, :2], corners[:, 1, :2], corners[:, 2, :2]
        ab, ac = b - a, c - a
        double_area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
        low = np.ceil(corners[..., :2].min(axis=1) - 0.5).astype(int)  # first sample whose centre is not left of it
        high = np.floor(corners[..., :2].max(axis=1) - 0.5).astype(int)
        solid = np.abs(double_area) > 1e-12
        if self.closed:
            solid &= double_area < 0  # rows run downwards: these show their outside
        reach = np.where(solid[:, None], high - low, -1)
        for right in range(int(reach[:, 0].max(initial=-1)) + 1):
            some = np.flatnonzero(reach[:, 0] >= right)
            for down in range(int(reach[some, 1].max(initial=-1)) + 1):
                pick = some[reach[some, 1] >= down]
                x, y = low[pick, 0] + right, low[pick, 1] + down
                px, py = x + 0.5 - a[pick, 0], y + 0.5 - a[pick, 1]
                wb = (px * ac[pick, 1] - py * ac[pick, 0]) / double_area[pick]
                wc = (py * ab[pick, 0] - px * ab[pick, 1]) / double_area[pick]
                hit = (wb > -SLACK) & (wc > -SLACK) & (wb + wc < 1 + SLACK)
                hit &= (x >= 0) & (y >= 0) & (x < self.shape[1]) & (y < self.shape[0])
                weights = np.stack([1 - wb[hit] - wc[hit], wb[hit], wc[hit]], axis=1)
                place = y[hit] * self.shape[1] + x[hit]
                self._keep(place, pick[hit], weights, corners, normals, values, double_area)

    def _keep(self, place, piece, weights, corners, normals, values, double_area):
        depth = np.einsum("pi,pi->p", weights, corners[piece, :, 2])
        front = depth > self.depth[place]
        place, piece, weights, depth = place[front], piece[front], weights[front], depth[front]
        order = np.argsort(depth, kind="stable")  # of several at one sample the last assigned remains
        place, piece, weights = place[order], piece[order], weights[order]
        self.depth[place] = depth[order]
        self.outside[place] = double_area[piece] < 0
        self.normal[place] = np.einsum("pi,pij->pj", weights, normals[piece])
        self.values[place] = np.einsum("pi,pij->pj", weights, values[piece])


def sample(nodes, normals, values, order, closed, view, origin, scale, width, height):
    """The surface of cells given by their nodes [cells, n, 3], with normals and values [cells, n, m] there, as Samples.

    `origin` is the upper left corner of the picture in the plane of the view, `scale` samples a unit of length.
    """
    out = Samples(width, height, values.shape[-1], closed)
    seen = scale * (nodes @ view.axes - (*origin, 0)) * (1, -1, 1)
    turned = normals @ view.axes
    # A side is at most as long as the path through its nodes.
    k = order
    rim = [0, *range(3, 2 + k), 1, *range(2 + k, 1 + 2 * k), 2, *range(1 + 2 * k, 3 * k), 0]
    steps = np.linalg.norm(np.diff(seen[:, rim, :2], axis=1), axis=2).max(axis=1) * k
    pieces = np.exp2(np.ceil(np.log2(np.clip(steps / PIECE, 1, MAX_PIECES)))).astype(int)
    for n in np.unique(pieces):
        places, corners = division(n)
        basis = lagrange(order, places)
        cells = np.flatnonzero(pieces == n)
        for some in np.array_split(cells, max(1, len(cells) * n * n // CHUNK)):
            at = [(basis @ field[some])[:, corners] for field in (seen, turned, values)]
            out.add(*(field.reshape(-1, 3, field.shape[-1]) for field in at))
    return out


def shade(cosine):
    """What is left of a colour where the normal has this cosine to the eye: all of it (97 % up to 60 degrees) but at the rim,
    whatever the side, so that equal values look alike."""
    return 1 - RIM_SHADE * (1 - np.clip(cosine, 0, 1)) ** 4


def shaded(samples, colours):
    """RGBA picture, one pixel for OVERSAMPLING^2 samples; `colours` [n, 3] of the outside where
    something is, in the order of the samples."""
    hit = np.isfinite(samples.depth)
    outside = samples.outside[hit]
    normal = samples.normal[hit]
    normal /= np.where(outside, 1, -1)[:, None] * np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    rgb = np.where(outside[:, None], colours, 0.26 * colours + 0.24)  # paler inside, and darker
    rgb = rgb * shade(normal[:, 2])[:, None]
    rgba = np.zeros((hit.size, 4))
    rgba[hit] = np.column_stack([rgb, np.ones(len(rgb))])
    edge = (_edges(samples, hit) * hit)[:, None]
    rgba[:, :3] = (1 - edge) * rgba[:, :3] + edge * OUTLINE
    h, w = samples.shape
    s = OVERSAMPLING
    mean = rgba.reshape(h // s, s, w // s, s, 4).mean(axis=(1, 3))
    mean[..., :3] /= np.maximum(mean[..., 3:], 1e-9)  # was weighted by coverage
    return (255 * np.clip(mean, 0, 1)).round().astype(np.uint8)


def _edges(samples, hit):
    """Weight of the outline at each sample, 0 to 1: the rim of the surface, or of a part that hides another."""
    h, w = samples.shape
    begin, full = (jump * max(h, w) for jump in JUMPS)
    depth = np.where(hit, samples.depth, -1e300).reshape(h, w)
    edge = np.zeros((h, w))
    for axis in (0, 1):
        nearer = np.diff(depth, axis=axis)
        first, second = _neighbours(axis)
        edge[second] = np.maximum(edge[second], np.clip((nearer - begin) / (full - begin), 0, 1))
        edge[first] = np.maximum(edge[first], np.clip((-nearer - begin) / (full - begin), 0, 1))
    thick = edge.copy()  # grown by one sample
    for axis in (0, 1):
        first, second = _neighbours(axis)
        thick[first] = np.maximum(thick[first], edge[second])
        thick[second] = np.maximum(thick[second], edge[first])
    return thick.ravel()


def _neighbours(axis):
    before, after = [slice(None)] * 2, [slice(None)] * 2
    before[axis], after[axis] = slice(None, -1), slice(1, None)
    return tuple(before), tuple(after)
