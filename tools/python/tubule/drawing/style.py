"""Style and output of pictures."""

import os
from contextlib import contextmanager

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from .labels import formula, number
from .results import BadInput

WIDTH = 7.0  # inches: the text width of a two-column page
DPI = 300  # of PNG, and of pictures within SVG and PDF; see resolution()
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
def resolution(dpi):
    """Draws and writes with this DPI meanwhile."""
    global DPI
    if not DPI_RANGE[0] <= dpi <= DPI_RANGE[1]:
        raise BadInput(f"--dpi: {number(dpi)} is not between {DPI_RANGE[0]} and {DPI_RANGE[1]} pixels per inch")
    before, DPI = DPI, dpi
    try:
        yield
    finally:
        DPI = before


def line_colours(n):
    """n colours that differ in lightness, so that they remain distinct in grey and for colour-blind readers."""
    shades = [0.1] if n == 1 else [0.78 * i / (n - 1) for i in range(n)]
    return [plt.get_cmap("viridis")(shade) for shade in shades]


def axes_at(figure, left, bottom, width, height, **options):
    """Axes at a place of the page in inches."""
    wide, tall = figure.get_size_inches()
    return figure.add_axes([left / wide, bottom / tall, width / wide, height / tall], **options)


def legend_beside(axes, handles, **options):
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0, **options)


def result_handles(labels):
    """The legend of the colours of several results; one has none."""
    several = labels if len(labels) > 1 else []
    return [Line2D([], [], color=c, label=", ".join(label)) for c, label in zip(line_colours(len(labels)), several)]


def time_name(index):
    return formula(f"t_{{{index}}}")


def time_text(time):
    return number(float(f"{time:.4g}"))


def time_title(index, time):
    """The words above the shapes at this time; None: above the last ones."""
    return "last state" if time is None else f"{time_name(index)} = {time_text(time)}"


def draw_scale_bar(axes, x, y, length, scale):
    """An upright bar of about this length, rounded to one digit, above (x, y); `scale` inches per unit of length."""
    bar = float(f"{length:.0e}")
    axes.plot([x, x], [y, y + scale * bar], color="0.1", linewidth=1.0, solid_capstyle="butt")
    axes.text(x + 0.05, y + scale * bar / 2, number(bar), ha="left", va="center", fontsize=7)


def check_outputs(paths):
    """Raises BadInput, before any work, for a picture that cannot be written."""
    for path in paths:
        if os.path.splitext(path)[1].lower() not in FORMATS:
            raise BadInput(f"{path}: a picture is written as one of {', '.join(FORMATS)}")
        folder = os.path.dirname(path) or "."
        if not os.path.isdir(folder):
            raise BadInput(f"{path}: the folder {folder} does not exist")


def save(figure, paths):
    for path in paths:
        metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(os.path.splitext(path)[1].lower())
        try:
            figure.savefig(path, dpi=DPI, metadata=metadata)
        except OSError as error:
            raise BadInput(f"{path}: cannot be written: {error.strerror}") from error
