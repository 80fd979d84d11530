"""The compiled kernels that move a scene: those kept with the package, or a written module where a law is not affine."""


def engine_of(scene):
    """Return an object with the kernels ``run``, ``sample``, ``workspace`` for the modes of a scene."""
    if not scene.closed_form:
        from .laws import engine_of_laws  # a scene loads the kernels that it calls for, and no others
        return engine_of_laws(scene)
    from . import kernels  # as above
    return kernels
