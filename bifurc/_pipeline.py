"""How numba is made to compile less: types of operators are remembered, what is only linked is neither translated nor optimised.

numba tries some ten templates, most of them for arrays, strings and dates, at every ``x + y`` of two numbers: twice when it finds
types, and once more when it writes code.  The answer depends on the operator and the types only, and is remembered.

Functions that only compiled callers call are linked into them as LLVM's intermediate code.  numba makes machine code of each by
itself, too, which nothing ever calls, and optimises it in full before that, although the caller is optimised as a whole with all
that is linked into it: a cheap pass by itself is enough.  Large loops over rows of a batch lost 7 to 12 % of their speed by that
(problem A and Duffing's oscillator of `studies.kernel_throughput`): they are no part of their callers, see `_jit.fused`.

numba compares the flags of a compilation at every call in it, by all that they may hold, and compiles ``np.empty`` once for each:
those here compare what was set and what a callee can see.  It computes where variables live after most of its passes, and reads it
after two of them.  To find the variables of an instruction it asks of every part of it what that may be, several times a pass.  For
the error of ``a[:] = b`` with other shapes it compiles functions that write numbers as text, 3 s of them.

All reach into numba, so that versions they were not tried with compile as they always do: the kernels are the same.
"""
import contextlib
import math
import operator
import types as types_of

import llvmlite.binding
import numba
from numba.core import codegen, compiler, ir, postproc, transforms, types
from numba.extending import overload
from numba.np import arrayobj

TRIED = ((0, 68),)  # versions of numba
PLAIN = (types.Number, types.Boolean, types.Literal, types.Array, types.SliceType)
WITHOUT = {str, int, float, bool, type(None), ir.Loc, types_of.BuiltinFunctionType, types_of.FunctionType}  # any variable
DOORS = {"no_cpython_wrapper", "no_cfunc_wrapper"}  # flags that no callee sees
ENVIRONMENT = "_ZN08NumbaEnv"  # how names of environments begin
OPERATORS = frozenset([value for module in (operator, math) for name, value in vars(module).items()
                       if callable(value) and not name.startswith("_")] + [abs, bool, float, int, len, max, min, range])


def _plain(args) -> bool:
    """Return whether no function of another package can be behind an operator on these types."""
    return all(isinstance(arg, PLAIN) or isinstance(arg, types.UniTuple) and k > 0 and isinstance(arg.dtype, types.Integer)
               for k, arg in enumerate(args))


@contextlib.contextmanager
def _less_work():
    """Put what is cheaper in the place of some functions of numba."""
    before = [(owner, name, vars(owner)[name]) for owner, name, _ in _CHEAPER]
    for owner, name, cheaper in _CHEAPER:
        setattr(owner, name, cheaper)
    try:
        yield
    finally:
        for owner, name, whole in before:
            setattr(owner, name, whole)


def _unequal(given, asked):
    """Raise the error of ``a[...] = b`` with arrays of other shapes, without these: to print them numba compiles 3 s of text."""


@overload(_unequal)
def _write_unequal(given, asked):
    def raise_it(given, asked):
        raise ValueError("cannot assign an array of another shape")
    return raise_it


_WHOLE = postproc.PostProcessor.run


def _postprocess(self, emit_dels=False, extend_lifetimes=False):
    """Prepare a function for the next pass; where variables live is computed by numba when a pass asks for it.

    It is computed ahead, by every pass anew, for generators and for functions that numba cannot compile.
    """
    function = self.func_ir
    if function.is_generator:
        _WHOLE(self, emit_dels, extend_lifetimes)
        return
    function.blocks = transforms.canonicalize_cfg(function.blocks)
    function.variable_lifetime, function.generator_info = postproc.VariableLifetime(function.blocks), None
    if emit_dels:
        self._insert_var_dels(extend_lifetimes=extend_lifetimes)


_EACH = ir.Inst._rec_list_vars


def _variables(self, value):
    """Return the variables in an instruction, by what the types of its parts are: numba asks each what it may be, and goes on."""
    kind = type(value)
    if kind is ir.Var:
        return [value]
    if kind not in (dict, list, tuple):
        return [] if kind in WITHOUT else _EACH(self, value)
    found = []
    for part in value.values() if kind is dict else value:
        kind = type(part)
        if kind is ir.Var:
            found.append(part)
        elif kind not in WITHOUT:
            found += _variables(self, part)
    return found


_FIND = types.BaseFunction.get_call_type
_signatures: dict[tuple[int, ...], tuple] = {}  # of operators on types, by what these are, which stay alive with them


def _signature(self, context, args, kws):
    """Return the signature of a call; operators on numbers and arrays are remembered, those that fail are not."""
    if kws or self.typing_key not in OPERATORS or not _plain(args):
        return _FIND(self, context, args, kws)
    names = id(context), id(self), *map(id, args)
    if names not in _signatures:
        _signatures[names] = _FIND(self, context, args, kws), (context, self, *args)
    return _signatures[names][0]


_CHEAPER = ((arrayobj, "raise_with_shape_context", _unequal), (postproc.PostProcessor, "run", _postprocess),
            (ir.Inst, "_rec_list_vars", _variables), (types.BaseFunction, "get_call_type", _signature))


class _Flags(compiler.Flags):
    """Flags of a compilation, equal to others that make the same code of a callee."""

    __slots__ = ()

    def __hash__(self) -> int:
        return _HASH

    def __eq__(self, other) -> bool:
        if not isinstance(other, compiler.Flags):
            return NotImplemented
        mine, others, options = self._values, other._values, compiler.Flags.options
        return mine == others or all(mine.get(name, options[name].default) == others.get(name, options[name].default)
                                     for name in mine.keys() | others.keys() if name not in DOORS)


_HASH = hash(compiler.Flags())  # of the names of what they may hold: the same for all


def for_this_numba(pipeline):
    """Return the pipeline, or numba's own for a version that it was not tried with."""
    return pipeline if numba.version_info.short in TRIED else compiler.Compiler


class _Library(codegen.JITCodeLibrary):
    """The code of a function, optimised with all that it calls: before that, a function by itself, little is enough."""

    def _optimize_functions(self, ll_module):
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager(opt=1)
                passes.run(function, builder)


class _Part(_Library):
    """The code of a function for its callers; of machine code only the places where numba keeps the globals of functions."""

    def _optimize_final_module(self):
        passes, builder = self._codegen._module_pass_manager(opt=0, loop_vectorize=False, slp_vectorize=False)
        passes.run(self._final_module, builder)

    def _finalize_final_module(self):
        whole, places = self._final_module, []
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True  # this code is what callers link
        self._get_module_for_linking()
        for variable in whole.global_variables:
            if variable.name.startswith(ENVIRONMENT):
                places.append(f"@{variable.name} = common global i64 0")
        self._final_module = llvmlite.binding.parse_assembly("\n".join(places))
        self._final_module.name, self._final_module.data_layout = whole.name, whole.data_layout
        self._final_module.triple = whole.triple
        super()._finalize_final_module()


class Pipeline(compiler.Compiler):
    """numba's own pipeline, with less work."""

    library_class = _Library

    def __init__(self, typing_context, target_context, library, args, return_type, flags, local_types):
        super().__init__(typing_context, target_context, library, args, return_type, _Flags(flags), local_types)

    def compile_extra(self, func):
        """Compile a function into a library of its own."""
        self.state.library = self.library_class(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        with _less_work():
            return super().compile_extra(func)


class Linked(Pipeline):
    """The pipeline of functions that only compiled callers call."""

    library_class = _Part


class Separate(Linked):
    """The pipeline of functions for compiled callers whose arrays do not overlap.

    Where it knows that, LLVM makes vector instructions of loops of few turns, too: for those it writes no check at run time.
    """

    def compile_extra(self, func):
        """Compile a function whose pointers are distinct."""
        self.state.flags.noalias = True
        return super().compile_extra(func)
