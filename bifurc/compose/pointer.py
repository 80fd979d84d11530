"""Mode tables as compiled code sees them: one pointer to a list of addresses and lengths.

numba passes a tuple of arrays as all its parts: 30 arrays are more than 200 arguments of a function and of every call in
it, with a reference count each; much of the time to compile a kernel, and most of a short call, went there.  Behind one
pointer a kernel loads the few parts that it reads.  The arrays are borrowed: whoever calls a kernel holds the tables.
"""
import array
import zlib
from collections.abc import Iterable

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import make_array, populate_array

WORD = 8  # bytes of an address, a length, and a number of the arrays


class Pointer(types.Type):
    """Type of a `directory`; its attribute ``address`` is that of its first number.

    Parameters
    ----------
    name : str
    parts : tuple of (str, str, int)
        Name, "float64" or "int64", and dimensions of every array, in the order of the directory; they are contiguous.
    """

    def __init__(self, name: str, parts: tuple):
        self.parts = parts
        # part of every symbol: short; the layout is in it, so that a kept kernel of another layout is not taken for this one
        super().__init__(f"{name}_{zlib.crc32(repr(parts).encode()):x}")

    def place(self, part: str) -> tuple[int, types.Array] | None:
        """Return where the entry of an array begins, in words, and the type of the array."""
        start = 0
        for name, kind, dimensions in self.parts:
            if name == part:
                return start, types.Array(getattr(types, kind), dimensions, "C")
            start += 1 + dimensions
        return None


def directory(cls: type, words: Iterable[int]) -> array.array:
    """Return addresses and lengths of arrays (``words``) one after the other, as an object of a class derived from `array.array`.

    numba knows objects with a buffer by its format (.5 us a call); of any other it asks Python for the type (4 us).
    """
    return array.array.__new__(cls, "q", words)


def seen_as(cls: type, pointer: Pointer) -> None:
    """Make compiled functions take objects of a class as this pointer."""
    typeof_impl.register(cls)(lambda value, context: pointer)


register_model(Pointer)(models.OpaqueModel)


@unbox(Pointer)
def _address(kind, value, c):
    """Read the attribute ``address``."""
    number = c.pyapi.object_getattr_string(value, "address")
    address = c.builder.inttoptr(c.pyapi.long_as_longlong(number), cgutils.voidptr_t)
    c.pyapi.decref(number)
    return NativeValue(address, is_error=cgutils.is_not_null(c.builder, c.pyapi.err_occurred()))


@infer_getattr
class _Parts(AttributeTemplate):
    """Types of the attributes."""

    key = Pointer

    def generic_resolve(self, value, attr):
        place = value.place(attr)
        return None if place is None else place[1]


@lower_getattr_generic(Pointer)
def _part(context, builder, kind, value, attr):
    """Load address and lengths of an array; they never change, which lets LLVM move the loads out of loops."""
    start, array_type = kind.place(attr)
    word = ir.IntType(64)
    words = builder.bitcast(value, word.as_pointer())
    constant = builder.module.add_metadata([])

    def load(k):
        number = builder.load(builder.gep(words, [ir.Constant(word, start + k)]))
        number.set_metadata("invariant.load", constant)
        return number

    made = make_array(array_type)(context, builder)
    address = builder.inttoptr(load(0), made.data.type)
    lengths = [load(1 + k) for k in range(array_type.ndim)]
    strides = [ir.Constant(word, WORD)]
    for length in reversed(lengths[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    populate_array(made, data=address, shape=lengths, strides=strides, itemsize=WORD, meminfo=None)
    return made._getvalue()


@intrinsic
def call(typing_context, address, arguments):
    """Call the C function at an address, which returns a number, with a tuple of numbers and of arrays (their first place)."""
    kinds = arguments.types

    def codegen(context, builder, signature, values):
        pointer, packed = values
        given = [builder.extract_value(packed, k) for k in range(len(kinds))]
        given = [make_array(kind)(context, builder, value).data if isinstance(kind, types.Array) else value
                 for kind, value in zip(kinds, given, strict=True)]
        function = ir.FunctionType(ir.DoubleType(), [value.type for value in given])
        return builder.call(builder.inttoptr(pointer, function.as_pointer()), given)

    return types.float64(types.intp, arguments), codegen
