"""Every picture is, in all its lines, marks, labels and limits, what was seen and found good."""

import json

from tests.plotting import pictures


def test_pictures_are_what_was_seen():
    known = json.loads(pictures.KNOWN.read_text(encoding="utf-8"))
    differs = pictures.same(json.loads(json.dumps(pictures.pictures())), known["pictures"])
    assert not differs, "\n".join([*differs[:20], "meant so? python -m tests.plotting.pictures writes anew; look at them first"])


def test_words_and_colours_are_what_was_seen():
    known = json.loads(pictures.KNOWN.read_text(encoding="utf-8"))
    assert not pictures.same(json.loads(json.dumps(pictures.words())), known["words"])


def test_pictures_make_figures_of_their_own():
    """Without axes: one figure of pyplot each, of the size that it was given."""
    from matplotlib import pyplot

    from bifurc import plotting
    from bifurc.plotting.motions import loops

    chart = pictures.Made(parameters=("a", "b"), values=([1.0, 2.0], [3.0, 4.0]), impacts=[[1.0, 2.0], [3.0, 4.0]])
    diagram = pictures.Made(
        parameter="a", values=pictures.np.array([1.0, 2.0]), directions=("up",), points=pictures.np.ones((1, 2, 1, 1, 2))
    )
    backbone = pictures.Made(omega=[1.0, 2.0], amplitude=pictures.np.array([0.1, 0.2]), damping=[0.1, 0.2])
    feedback = pictures.Made(
        intervals=[],
        gains=pictures.np.array([0.0, 1.0]),
        moduli=[1.0, 0.5],
        ends=[],
        best_gain=None,
        bounds=(0.0, 1.0),
        of="velocity",
    )
    path = pictures.path(pictures.np.arange(3.0))
    delayed = pictures.Made(sections=path, start=0.0, stop=1.0, feedback=pictures.np.cos)
    made = pictures.motion([pictures.ElasticStator(radius=0.8)])
    calls = [
        (plotting.plot_branch, (pictures.branch(),), (6.3, 3.9)),
        (plotting.plot_basins, (pictures.basins(),), (6.3, 4.6)),
        (plotting.plot_field, (pictures.basins(), "periods"), (6.3, 4.0)),
        (plotting.plot_chart, (chart, None, "impacts"), (6.3, 4.4)),
        (plotting.plot_cells, (pictures.cells(),), (6.3, 4.4)),
        (plotting.plot_morse, (pictures.cells(),), (6.3, 4.2)),
        (plotting.plot_atlas, (pictures.atlas(),), (6.3, 4.6)),
        (plotting.plot_backbone, (backbone,), (6.6, 3.0)),
        (plotting.plot_feedback, (feedback,), (5.2, 3.4)),
        (plotting.plot_delayed, (delayed,), (6.8, 2.9)),
        (plotting.plot_controlled, (pictures.Made(states=path, corrections=[0.1], parameter="gap"),), (6.8, 2.9)),
        (plotting.plot_curve, (pictures.curve(),), (5.4, 3.9)),
        (plotting.plot_diagram, (diagram,), (6.3, 3.9)),
        (plotting.plot_map_diagram, (pictures.Made(parameter="mu", values=[1.0], points=pictures.np.ones((1, 2, 1))),), (6.3, 3.9)),
        (plotting.plot_responses, ([pictures.branch()], [1.0], "zeta"), (6.3, 3.9)),
        (plotting.plot_ramp, (pictures.ramp(),), (6.3, 3.9)),
        (plotting.plot_peaks, ({"a": (pictures.curve(), [])}, "omega"), (6.3, 3.9)),
        (plotting.plot_sweep, (pictures.sweep(),), (6.3, 5.4)),
        (plotting.plot_orbit, (made,), (6.9, 3.1)),
        (plotting.plot_trajectory, (made,), (6.9, 3.1)),
        (plotting.plot_full_spectrum, (made,), (5.2, 2.6)),
        (plotting.plot_loop, (pictures.loop(),), (3.6, 3.0)),
        (loops.plot_states, (pictures.loop(),), (4.2, 2.6)),
    ]
    for draw, given, size in calls:
        drawn = draw(*given)
        figure = (drawn[0] if isinstance(drawn, list | tuple | pictures.np.ndarray) else drawn).figure
        assert figure.get_size_inches().tolist() == list(size), draw.__name__
        assert figure.number in pyplot.get_fignums()
        pyplot.close("all")
