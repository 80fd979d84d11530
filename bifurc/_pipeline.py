"""How numba is made to compile less: types of operators are remembered, what is only linked is neither translated nor optimised.

numba tries some ten templates, most of them for arrays, strings and dates, at every ``x + y`` of two numbers, twice a function.
The answer depends on the operator and the types only: remembering it saves a third of the time that finding types takes.

Functions that only compiled callers call are linked into them as LLVM's intermediate code.  numba makes machine code of each by
itself, too, which nothing ever calls, and optimises it in full before that, although the caller is optimised as a whole with all
that is linked into it: a cheap pass by itself is enough.  Large loops over rows of a batch lost 7 to 12 % of their speed by that
(problem A and Duffing's oscillator of `studies.kernel_throughput`): they are no part of their callers, see `_jit.fused`.

numba compares the flags of a compilation at every call in it, by all that they may hold, and compiles ``np.empty`` once for each:
those here compare what was set and what a callee can see.  It computes where variables live after most of its passes, and reads it
after two of them.  For the error of ``a[:] = b`` with other shapes it compiles functions that write numbers as text, 3 s of them.

All reach into numba, so that versions they were not tried with compile as they always do: the kernels are the same.
"""
import contextlib
import math
import operator

import llvmlite.binding
import numba
from numba.core import codegen, compiler, postproc, transforms, types
from numba.extending import overload
from numba.np import arrayobj

TRIED = ((0, 68),)  # versions of numba
PLAIN = (types.Number, types.Boolean, types.Literal, types.Array, types.SliceType)
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
    """Put what is cheaper in the place of two functions of numba."""
    before = arrayobj.raise_with_shape_context, postproc.PostProcessor.run
    arrayobj.raise_with_shape_context, postproc.PostProcessor.run = _unequal, _postprocess
    try:
        yield
    finally:
        arrayobj.raise_with_shape_context, postproc.PostProcessor.run = before


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


class _Flags(compiler.Flags):
    """Flags of a compilation, equal to others that make the same code of a callee."""

    __slots__ = ()

    def __hash__(self) -> int:
        return _HASH

    def __eq__(self, other) -> bool:
        if not isinstance(other, compiler.Flags):
            return NotImplemented
        mine, others = self._values, other._values
        return mine == others or all(getattr(self, name) == getattr(other, name) for name in (mine.keys() | others.keys()) - DOORS)


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
    """numba's own pipeline, with a typing context that remembers operators and functions of numbers and arrays."""

    library_class = _Library

    def __init__(self, typing_context, target_context, library, args, return_type, flags, local_types):
        super().__init__(_remembering(typing_context), target_context, library, args, return_type, _Flags(flags), local_types)

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
        """Compile a function whose pointers are told apart."""
        self.state.flags.noalias = True
        return super().compile_extra(func)


def _remembering(context):
    """Return a typing context that shares everything with a given one, and remembers; the same one for each."""
    found = vars(context).get("_bifurc_remembers")
    if found is None:
        kind = type(context)
        made = type(f"Remembering{kind.__name__}", (_Memory, kind), {})
        found = object.__new__(made)
        context._bifurc_remembers = found
        found.__dict__ = vars(context)
    return found


class _Memory:
    """Signatures of operators, by the function type and the argument types; numba makes each of these once."""

    def _recall(self, key, find):
        """Return what is remembered under a key of objects, which stay alive with it, or find it."""
        memory = self.__dict__.setdefault("_bifurc_signatures", {})
        names = tuple(map(id, key))
        found = memory.get(names)
        if found is None:
            signature = find()
            if signature is None:
                return None
            found = memory[names] = signature, key
        return found[0]

    def resolve_function_type(self, func, args, kws):
        """Return the signature of a call."""
        if not kws and isinstance(func, types.Function) and func.typing_key in OPERATORS and _plain(args):
            return self._recall((func, *args), lambda: super(_Memory, self).resolve_function_type(func, args, kws))
        return super().resolve_function_type(func, args, kws)

    def resolve_setitem(self, target, index, value):
        """Return the signature of ``target[index] = value``."""
        args = target, index, value
        if _plain(args):
            return self._recall((operator.setitem, *args), lambda: super(_Memory, self).resolve_setitem(*args))
        return super().resolve_setitem(*args)
