"""Pictures of the gallery are drawn in the package's own style; sphinx-gallery sets it before each page."""
import matplotlib

from bifurc.plotting import style


def house_style(gallery_conf, fname):
    """Set fonts, ticks and lines of the package's pictures (signature of sphinx-gallery's ``reset_modules``)."""
    matplotlib.rcParams.update({**style.RC, "savefig.dpi": 200})
