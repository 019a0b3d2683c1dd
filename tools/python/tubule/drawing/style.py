"""Style and output of pictures."""

import os
from contextlib import contextmanager

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from .command_line import check_output
from .labels import formula, number
from .results import BadInput

WIDTH = 7.0  # inches: the text width of a two-column page; see page()
NARROW = 5.0  # inches: below, legends and colour bars stand below each other
DPI = 300  # of PNG, and of pictures within SVG and PDF; see page()
DPI_RANGE = 30, 1200
FORMATS = (".png", ".svg", ".pdf")
MARKERS = "os^Dv<>p"
DASHES = ("--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)))  # of energy terms; the total is solid

SETTINGS = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "tubule",  # the same picture gives the same file
    "pdf.fonttype": 42,
}


def apply():
    """For a process that does nothing but draw."""
    plt.switch_backend("agg")  # no windows
    plt.rcParams.update(SETTINGS)


@contextmanager
def page(dpi, width):
    """Draws and writes with this DPI and WIDTH meanwhile."""
    global DPI, WIDTH
    if not DPI_RANGE[0] <= dpi <= DPI_RANGE[1]:
        raise BadInput(f"--dpi: {number(dpi)} is not between {DPI_RANGE[0]} and {DPI_RANGE[1]} pixels per inch")
    before, DPI, WIDTH = (DPI, WIDTH), dpi, width
    try:
        yield
    finally:
        DPI, WIDTH = before


def is_narrow():
    return WIDTH < NARROW


def slots(count):
    """Where this many colour bars stand: left end and width as parts of the page, and their line, 0 at the bottom."""
    if is_narrow():
        return [(0.1, 0.8, count - 1 - i) for i in range(count)]
    known = {1: ((0.29, 0.42),), 2: ((0.12, 0.34), (0.56, 0.34))}.get(count)
    return [(*slot, 0) for slot in known or [(0.05 + 0.95 * i / count, 0.95 / count - 0.06) for i in range(count)]]


class Legend:
    """Beside axes, or on a narrow page below them. `right` and `below` are the inches that it needs there."""

    SIZE, LINE = 0.06, 0.155  # inches: of a letter, of a line

    def __init__(self, handles):
        self.handles = handles
        texts = [handle.get_label() for handle in handles]
        widest = max((len(line) for text in texts for line in text.split("\n")), default=0)
        self.columns = max(1, int(WIDTH / (0.6 + self.SIZE * widest))) if is_narrow() else 1
        self.right = 0.0 if is_narrow() or not handles else 0.5 + self.SIZE * widest
        lines = max((text.count("\n") + 1 for text in texts), default=1) * -(-len(texts) // self.columns)
        self.below = self.LINE * lines + 0.1 if is_narrow() and handles else 0.0

    def draw(self, axes, bottom):
        """`bottom`: inches above the figure's edge of the room below."""
        if not self.handles:
            return
        place = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.02)}
        if is_narrow():
            top = (bottom + self.below) / axes.figure.get_figheight()
            place = {"loc": "upper center", "bbox_to_anchor": (0.5, top), "bbox_transform": axes.figure.transFigure,
                     "ncols": self.columns, "columnspacing": 1.0}  # fmt: skip
        axes.legend(handles=self.handles, borderaxespad=0, labelspacing=0.4, **place)


def few_ticks(axis, inches, least=0.5):
    """Round numbers, at least so many inches apart."""
    axis.set_major_locator(MaxNLocator(max(1, min(5, int(inches / least))), steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))


def line_colours(n):
    """n colours that differ in lightness, so that they remain distinct in grey and for colour-blind readers."""
    shades = [0.1] if n == 1 else [0.78 * i / (n - 1) for i in range(n)]
    return [plt.get_cmap("viridis")(shade) for shade in shades]


def axes_at(figure, left, bottom, width, height, **options):
    """Axes at a place of the page in inches."""
    wide, tall = figure.get_size_inches()
    return figure.add_axes([left / wide, bottom / tall, width / wide, height / tall], **options)


def result_handles(labels):
    """The legend of the colours of several results; one has none."""
    several = labels if len(labels) > 1 else []
    return [Line2D([], [], color=c, label=", ".join(label)) for c, label in zip(line_colours(len(labels)), several)]


def time_name(index):
    return formula(f"t_{{{index}}}")


def time_text(time, unit=""):
    return f"{number(float(f'{time:.4g}'))} {unit}".rstrip()


def time_title(index, time, unit):
    """The words above the shapes at this time; None: above the last ones, each at its own time."""
    return "last state" if time is None else f"{time_name(index)} = {time_text(time, unit)}"


def draw_scale_bar(axes, x, y, length, scale, unit):
    """An upright bar of about this length, rounded to one digit, above (x, y); `scale` inches per unit of length."""
    bar = float(f"{length:.0e}")
    axes.plot([x, x], [y, y + scale * bar], color="0.1", linewidth=1.0, solid_capstyle="butt")
    axes.text(x + 0.05, y + scale * bar / 2, f"{number(bar)} {unit}".rstrip(), ha="left", va="center", fontsize=7)


def check_outputs(paths):
    """Raises BadInput, before any work, for a picture that cannot be written."""
    for path in paths:
        check_output(path, FORMATS, "a picture is")


def save(figure, paths):
    for path in paths:
        metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(os.path.splitext(path)[1].lower())
        try:
            figure.savefig(path, dpi=DPI, metadata=metadata)
        except OSError as error:
            raise BadInput(f"{path}: cannot be written: {error.strerror}") from error
