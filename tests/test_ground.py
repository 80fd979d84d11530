"""The ground under the package: systems and their parameters, files, words, notebooks, lazy and old names, in their corners."""
import errno
import inspect
import json
import logging
import os
import subprocess
import types
import warnings
import zipfile

import numpy as np
import pytest

import bifurc as bf
from bifurc import io, lazy, loading, notebook, warm
from bifurc._cache import _imported, _path, cache_folder, closure_hash, kernel_folder
from bifurc.elements import BaseMotion, Coulomb, HarmonicForce, Jenkins, RigidStop
from bifurc.enumerations import DescribedEnum
from bifurc.motion import Motion
from bifurc.system import SYMMETRIC, System, builder, require_system

M, C, K = [[2.0, 0.5], [0.5, 1.0]], [[0.1, 0.2], [-0.3, 0.4]], [[3.0, -1.0], [-0.7, 2.0]]


# ---- systems -------------------------------------------------------------------------------------------------------------------


def made(**more):
    given = {"elements": [HarmonicForce(0.5), RigidStop(1.0), RigidStop(1.5, dof=1)], "omega": 0.7, "dofs": ["a", "b"], **more}
    return System(M, C, K, **given)


@pytest.mark.parametrize("off, taken", [(0.9, True), (1.1, False)])
def test_a_mass_is_symmetric_but_for_rounding(off, taken):
    mass = np.array([[2.0, 0.5], [0.5 + off * SYMMETRIC * 2.0, 1.0]])
    if taken:
        found = System(mass, C, K).mass
        assert np.array_equal(found, found.T) and 0.5 < found[0, 1] < mass[1, 0]
    else:
        with pytest.raises(ValueError, match="it must be symmetric"):
            System(mass, C, K)


@pytest.mark.parametrize("mass, words", [
    ([[1.0, 1.0], [1.0, 1.0]], "positive definite"), ([[1.0, 0.0], [0.0, -1e-3]], "positive definite"), (0.0, "positive definite"),
    (-1.0, "positive definite"), (np.nan, "mass = nan is not allowed; it must be finite"), ([[1.0, 2.0]], "mass has shape .1, 2."),
    (np.zeros((0, 0)), "mass has shape .0, 0."), ("x", "mass = 'x' is not allowed; it must be a number or a square matrix"),
    ([[1.0, np.inf], [np.inf, 1.0]], "it must be finite")])
def test_masses_that_are_none(mass, words):
    with pytest.raises(ValueError, match=words):
        System(mass, 0.0 if np.ndim(mass) == 0 else np.zeros((2, 2)), 1.0 if np.ndim(mass) == 0 else np.eye(2))


def test_light_masses_and_copies():
    assert System([[1.0, 0.0], [0.0, 1e-14]], np.zeros((2, 2)), np.eye(2)).n == 2
    given = np.eye(2)
    system = System(given, given, given)
    given[0, 0] = 5.0
    assert system.mass[0, 0] == system.damping[0, 0] == system.stiffness[0, 0] == 1.0
    for matrix in (system.mass, system.damping, system.stiffness):
        with pytest.raises(ValueError, match="read-only"):
            matrix[0, 0] = 2.0
    with pytest.raises(AttributeError, match="a System is immutable"):
        system.omega = 2.0
    for name, matrix in (("damping", np.eye(3)), ("stiffness", np.eye(3))):
        with pytest.raises(ValueError, match=f"{name} has shape .3, 3.; it must be that of mass, .2, 2."):
            System(**{"mass": np.eye(2), "damping": np.eye(2), "stiffness": np.eye(2), name: matrix})
    for parts, words in ((3, "elements = 3 is not allowed; it must be a list"),
                         ([3], r"elements\[0\] = 3 is not allowed; it must be an instance of Element")):
        with pytest.raises(ValueError, match=words):
            System(1.0, 0.0, 1.0, parts)
    for parts in ([HarmonicForce()], [BaseMotion()], [RigidStop(amplitude=0.1, harmonic=1)]):
        with pytest.raises(ValueError, match="omega = None is not allowed with .*, which has harmonics of it"):
            System(1.0, 0.0, 1.0, parts)


def test_what_a_system_tells_of_itself():
    system = made()
    assert system.period == pytest.approx(2.0 * np.pi / 0.7) and System(1.0, 0.0, 1.0).period is None
    assert system.labels == ("harmonic_force", "rigid_stop", "rigid_stop_2") and system.dof("b") == 1 and system.dof(0) == 0
    entries = [f"{name}[{i},{j}]" for name in ("mass", "damping", "stiffness") for i in (0, 1) for j in (0, 1)]
    assert list(system.parameters) == [*entries, "omega", "harmonic_force.amplitude", "harmonic_force.phase", "rigid_stop.gap",
                                       "rigid_stop.restitution", "rigid_stop_2.gap", "rigid_stop_2.restitution"]
    assert system.parameters["stiffness[1,0]"] == -0.7 and "omega" not in System(1.0, 0.0, 1.0).parameters
    assert repr(system) == "System(n=2, omega=0.7, elements=[harmonic_force, rigid_stop, rigid_stop_2])"
    assert repr(System(1.0, 0.0, 1.0)) == "System(n=1, omega=None, elements=[])"
    same = System(1.0, 0.0, 1.0, [RigidStop(label="x"), RigidStop(label="x"), RigidStop(label="x")])
    assert same.labels == ("x", "x_2", "x_3")
    assert system.structure == (2, False, *(part.structure for part in system.elements))
    assert System(1.0, 0.0, 1.0).structure == (1, True)
    y = np.arange(8.0).reshape(2, 4)
    assert np.array_equal(system.recover(y), y)
    for other in (made(omega=0.8), made(dofs=["a", "c"]), made(elements=[HarmonicForce(0.5)]), System(np.eye(2), C, K)):
        assert system != other and not system == other
    assert system == made() and system.__eq__(3) is NotImplemented and hash(system) == hash(made())
    assert require_system(system) is system
    with pytest.raises(ValueError, match="system = 3 is not allowed; it must be a System, such as"):
        require_system(3)


def test_names_of_parameters():
    system = made()
    for name, full in (("amplitude", "harmonic_force.amplitude"), ("omega", "omega"), ("rigid_stop_2.gap", "rigid_stop_2.gap"),
                       ("mass[0,1]", "mass[0,1]")):
        assert system.parameter_name(name) == full
    for name, words in (("gap", "'gap' is ambiguous; there are rigid_stop.gap, rigid_stop_2.gap"), ("mass", "'mass' is unknown"),
                        ("mass[2,0]", "is unknown"), ("mass[0,2]", "is unknown"),
                        (3, "parameter 3 is not allowed; it must be a name")):
        with pytest.raises(ValueError, match=words.replace("[", r"\[").replace("]", r"\]")):
            system.parameter_name(name)
    assert system.parameter("stiffness[1,0]") == -0.7 and system.parameter("phase") == 0.0
    one = System(2.0, 0.1, 3.0)
    assert one.parameter_name("mass") == "mass[0,0]"
    with pytest.raises(ValueError, match="'omega' is unknown"):
        one.parameter("omega")


def test_changed_systems():
    system = made()
    changed = system.with_parameters(**{"stiffness[0,1]": -2.0, "mass[0,1]": 0.4, "omega": 0.9, "rigid_stop_2.gap": 2.0,
                                        "amplitude": 0.6})
    assert changed.stiffness.tolist() == [[3.0, -2.0], [-0.7, 2.0]] and changed.mass.tolist() == [[2.0, 0.4], [0.4, 1.0]]
    assert (changed.omega, changed.elements[2].gap, changed.elements[1].gap, changed.elements[0].amplitude) == (0.9, 2.0, 1.0, 0.6)
    assert changed.dofs == ("a", "b") and system.stiffness[0, 1] == -1.0
    symmetric = System(M, np.eye(2), np.eye(2)).with_parameters(**{"damping[0,1]": 0.3})
    assert symmetric.damping.tolist() == [[1.0, 0.3], [0.3, 1.0]]
    with pytest.raises(ValueError, match=r"System: mass\[0,0\] = nan"):
        system.with_parameters(**{"mass[0,0]": np.nan})
    small = bf.System.from_matrices(np.diag([1.0, 0.0]), None, [[2.0, -1.0], [-1.0, 2.0]], elements=[RigidStop()])
    assert small.with_parameters(gap=0.3).reduction is small.reduction
    assert small.with_parameters(**{"mass[0,0]": 2.0}).reduction is None
    assert System.from_record(json.loads(json.dumps(small.to_record()))).reduction.method == "condensed"
    assert system.differs_in_omega_only(made(omega=3.0)) and not system.differs_in_omega_only(changed)


def test_images_under_reflection():
    pair = System(1.0, 0.1, 1.0, [HarmonicForce(), RigidStop(1.0), Jenkins(), RigidStop(1.0, side=-1)], omega=1.0)
    assert pair.mirror_order == (0, 3, 2, 1) and pair.symmetry == -1
    assert System(1.0, 0.1, 1.0, [Coulomb(0.5, 0.3)]).mirror_order is None and System(1.0, 0.1, 1.0).mirror_order == ()


def test_builders_keep_what_they_are_given():
    @builder
    def thing(*, a: float = 1.0, b: int = 2, c: float | None = None) -> System:
        """Return a thing."""
        return System(a, 0.0, b)

    made_ = thing(a=2, b=3)
    assert made_.parameters == {"a": 2.0, "b": 3, "c": None} and thing.__name__ == "thing" and thing.__doc__
    assert type(made_.parameters["a"]) is float and type(made_.parameters["b"]) is int
    assert made_.parameter_name("a") == "a" and made_.with_parameters(b=5).stiffness[0, 0] == 5.0
    record = made_.to_record()
    assert record == {"builder": "thing", "parameters": {"a": 2.0, "b": 3, "c": None}} and made_ == System.from_record(record)
    assert System.from_record(record, elements=[thing]) == made_
    for name in ("b", "c"):
        with pytest.raises(ValueError, match="cannot vary continuously; those that can: a"):
            made_.parameter(name)
    made_.parameters["a"] = 9.0
    assert made_.parameters["a"] == 2.0


# ---- files ---------------------------------------------------------------------------------------------------------------------


def test_files_that_are_none(tmp_path):
    for version in (0, -1, True, 1.0, None):
        path = tmp_path / "x.npz"
        header = json.dumps({"format": "bifurc", "version": version, "kind": "x"})
        np.savez(path, __header__=np.frombuffer(header.encode(), np.uint8))
        with pytest.raises(io.FileFormatError, match="has no valid layout version"):
            io.read(path)
    with pytest.raises(io.FileFormatError, match="is a folder, not a bifurc result"):
        io.read(tmp_path)
    (tmp_path / "cut.npz").write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(io.FileFormatError, match="is damaged"):
        io.read(tmp_path / "cut.npz")
    with pytest.raises(FileExistsError) as error:
        io.write(tmp_path / "cut.npz", {"kind": "x"}, {})
    assert error.value.errno == errno.EEXIST and "It is left alone; give another name, or remove it" in str(error.value)
    io.write(tmp_path / "cut.npz", {"kind": "x"}, {"a": [1]}, careful=False)
    assert io.header(tmp_path / "cut.npz", "x")["kind"] == "x" and io.read(tmp_path / "cut.npz")[1]["a"].tolist() == [1]
    with pytest.raises(io.FileFormatError, match="holds a 'x', expected a 'y'"):
        io.header(tmp_path / "cut.npz", "y")
    for compressed, kinds in ((True, {zipfile.ZIP_DEFLATED}), (False, {zipfile.ZIP_STORED})):
        path = io.write(tmp_path / "c.npz", {"kind": "x"}, {"a": np.zeros(1000)}, compressed)
        with zipfile.ZipFile(path) as content:
            assert {item.compress_type for item in content.infolist()} == kinds
    with pytest.raises(ValueError, match="header.'kind'. must name what the record is, got 3"):
        io.write(tmp_path / "d.npz", {"kind": 3}, {})
    assert not (tmp_path / "d.npz").exists()


def test_results_are_read_by_their_kind(tmp_path, monkeypatch):
    for path in (3, b"x", None):
        with pytest.raises(ValueError, match="load: path = .* is not allowed; it must be the path of a file"):
            bf.load(path)
    seen = []
    reader = types.SimpleNamespace(from_record=lambda *given, **more: seen.append((given, more)))
    monkeypatch.setattr(loading.importlib, "import_module", lambda name, package: types.SimpleNamespace(Branch=reader))
    io.write(tmp_path / "b.npz", {"kind": "branch", "n": 3}, {"a": [1.0]})
    loading.load(tmp_path / "b.npz")
    loading.load(os.fspath(tmp_path / "b.npz"), iter([RigidStop]))
    (first, none), (_, more) = seen
    assert first[0]["n"] == 3 and first[1]["a"].tolist() == [1.0] and none == {} and more == {"elements": (RigidStop,)}
    monkeypatch.undo()
    for module, name in loading._READERS.values():
        home = loading.importlib.import_module(module, "bifurc")
        assert hasattr(getattr(home, name), "from_record")


# ---- words ---------------------------------------------------------------------------------------------------------------------


def test_members_have_a_sentence_and_are_their_words():
    class Kind(DescribedEnum):
        ONE = "one", "The first."
        TWO = "two"

    assert Kind("one") is Kind.ONE and Kind.ONE == "one" and Kind.ONE.sentence == "The first." and Kind.TWO.sentence == ""
    assert f"{Kind.TWO}" == "two" and Kind.ONE.value == "one" and json.dumps(Kind.ONE) == '"one"'


def test_lazy_and_old_names():
    find, names = lazy.lazy("bifurc", {"Grid": "basins", "System": "system"}, ("systems",))
    assert find("System") is System and find("systems") is bf.systems and names() == ["Grid", "System", "systems"]
    with pytest.raises(AttributeError, match="module 'bifurc' has no attribute 'x'; it has Grid, System, systems"):
        find("x")
    old = lazy.renamed({"__name__": "here", "new": 7}, {"old": "new"})
    with pytest.warns(DeprecationWarning, match="here.old is called new now; the old name goes with the next version") as said:
        assert old("old") == 7
    assert said[0].filename == __file__
    with pytest.raises(AttributeError, match="module 'here' has no attribute 'new'"):
        old("new")


def test_a_motion_without_a_past():
    class Plain(Motion):
        def __repr__(self):
            return "plain"

    plain = Plain()
    assert (plain.periodic, plain.autonomous, plain.regime, plain.signature, plain.family) == (False, False, "", "", ())
    with pytest.raises(ValueError, match="history = plain is not allowed; it must be a motion, an orbit, or a function of time"):
        plain.past(0.0, 1.0)
    with pytest.raises(NotImplementedError):
        plain.sections  # noqa: B018


@pytest.mark.parametrize("value, words", [
    (True, "yes"), (np.bool_(False), "no"), (None, "unknown"), (1.5 - 2j, "1.5-2i"), (complex(3.0), "3"),
    (np.complex128(1j), "0+1i"),
    (1.23456789, "1.23457"), (np.float64(1e-9), "1e-09"), (3, "3"), ("text", "text"), ({"a": 1.5, "b": None}, "a: 1.5, b: unknown"),
    ([1, 2, 3, 4], "1, 2, 3, 4"), ((1, 2, 3, 4, 5), "1, 2, 3, 4, ... (5)"), (np.array([0.1, 0.2]), "0.1, 0.2"), ([], "")])
def test_values_in_few_words(value, words):
    assert notebook.short(value) == words


def test_tables_and_cards(caplog):
    class Rows(notebook.Table):
        _fields = ("name", "size")

    class Word(DescribedEnum):
        A = "a<b", "x"

    table = Rows([types.SimpleNamespace(name=Word.A, size=1.5), types.SimpleNamespace(name="c", size=None)])
    assert table._repr_html_() == ("<table><tr><th>name</th><th>size</th></tr><tr><td>a&lt;b</td><td>1.5</td></tr>"
                                   "<tr><td>c</td><td>unknown</td></tr></table>")
    frame = table.to_pandas()
    assert list(frame.columns) == ["name", "size"] and type(frame["name"][0]) is str and frame["size"][0] == 1.5
    assert notebook.plain(Word.A) == "a<b" and type(notebook.plain(Word.A)) is str and notebook.plain(3) == 3

    class Card(notebook.Notebook):
        _facts = ("a_b",)
        a_b = 2.5
        fails = True

        def __repr__(self):
            return "Card<>"

        def plot(self, axes):
            if self.fails:
                raise ValueError("no picture")
            axes[0].plot([1, 2])

    Card._panels = (1, 2)
    card = Card()
    with caplog.at_level(logging.DEBUG, "bifurc.notebook"):
        text = card._repr_html_()
    assert "<img" not in text and "no thumbnail of Card<>: no picture" in caplog.text
    assert "<code>Card&lt;&gt;</code>" in text and ">a b</th>" in text and ">2.5</td>" in text
    card.fails = False
    text = card._repr_html_()
    assert "<img alt='Card'" in text and "src='data:image/png;base64," in text
    Card._panels = None
    assert "<img" not in card._repr_html_()


# ---- where kernels lie, who compiles them --------------------------------------------------------------------------------------


def test_keys_of_modules_follow_what_they_import(tmp_path, monkeypatch):
    assert _path("bifurc.flow.scan").name == "scan.py" and _path("bifurc.flow").name == "__init__.py"
    assert _path("bifurc.elements").name == "kinds.py" and _path("bifurc._jit").name == "_jit.py" and _path("numpy") is None
    assert _path("bifurc.elements.stops") is None and _path("bifurc.system") is None and _path("bifurc") is None
    assert "bifurc.flow.rule" in _imported("bifurc.flow.scan", _path("bifurc.flow.scan"))
    assert len(closure_hash("bifurc.flow.scan")) == 16 and closure_hash("bifurc.flow.scan") != closure_hash("bifurc.flow.rule")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "given"))
    assert cache_folder() == tmp_path / "given" and cache_folder().is_dir()
    assert kernel_folder("bifurc.flow.scan") == tmp_path / "given" / closure_hash("bifurc.flow.scan")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / "bifurc" and os.environ["NUMBA_CACHE_DIR"] == str(tmp_path / "home" / "bifurc")


@pytest.mark.parametrize("codes, marked", [((0,), True), ((1,), False), (("late",), False)])
def test_a_cache_is_marked_when_the_helper_ended_well(tmp_path, monkeypatch, codes, marked):
    left, killed = list(codes), []

    class Process:
        def __init__(self, command, **options):
            self.code, self.open, self.stdin = left.pop(0), True, None
            assert options["stdout"] == options["stderr"] == subprocess.DEVNULL and command[1] == "-P"

        def wait(self, seconds):
            assert seconds == warm.LONGEST
            if self.code == "late":
                raise subprocess.TimeoutExpired("x", seconds)
            self.open = False
            return self.code

        def poll(self):
            return None if self.open else self.code

        def kill(self):
            killed.append(self.code)

    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.subprocess, "Popen", Process)
    said = []
    assert warm.warm_up(said.append) is True and len(said) == 1
    assert bool(list(tmp_path.iterdir())) is marked and bool(killed) is (codes[0] == "late")
    assert warm.warm_up(said.append) is not marked if marked else True
    monkeypatch.setenv("PYTHONPATH", "/somewhere")
    assert warm.same_package()["PYTHONPATH"].split(os.pathsep)[1:] == ["/somewhere"]
    monkeypatch.delenv("PYTHONPATH")
    assert warm.same_package()["PYTHONPATH"] == os.path.dirname(os.path.dirname(warm.__file__))


def test_public_names_come_from_where_they_are_said_to(monkeypatch):
    for name, home in bf._NAMES.items():
        value = getattr(bf, name)
        assert value is getattr(loading.importlib.import_module(home, "bifurc"), name)
        assert inspect.isclass(value) or callable(value)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert set(bf.__all__) == {*bf._MODULES, *bf._NAMES}
