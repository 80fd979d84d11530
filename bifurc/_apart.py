"""Functions that are compiled apart from their compiled callers, when they are called for the first time.

numba links the code of a function into every caller and optimises and translates the whole again, and it compiles a function
together with everything that it could ever call.  Behind `apart` a caller holds an address that is zero until it is needed
and then asks `_bind`, which compiles the function or loads it from the cache: large functions are compiled once, those of rare
events not before one happens.  A caller kept on disk stays valid: it names the function and its argument types, no address.
"""
import _thread
import base64
import ctypes
import pickle
import threading
import traceback
import zlib

import llvmlite.binding
from llvmlite import ir
from numba.core import cgutils, sigutils, types, typing

SYMBOL = "bifurc_bind"  # name of `_bind` in compiled code
_known: dict = {}  # dispatcher of every function, by module and name
_addresses: dict[bytes, int] = {}  # of compiled functions, by key
LATER = 0.05  # seconds after which an interruption is sent again: a compiled caller sees it at its end


class NotCompiled(Exception):
    """A function could not be compiled; what happened is printed.  No RuntimeError: nobody may take it for a failed computation."""


@ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_char_p)
def _bind(key):
    """Return the address of a function for given argument types, 0 if it cannot be compiled.  The GIL is taken by ctypes.

    An interruption from the keyboard cannot pass through the compiled caller: it waits until the function is compiled.
    """
    try:
        try:
            return _address(key)
        except KeyboardInterrupt:
            address = _address(key)
            again = threading.Timer(LATER, _thread.interrupt_main)
            again.daemon = True
            again.start()
            return address
    except BaseException:  # nor can it pass: the caller raises an error of its own
        traceback.print_exc()
        return 0


def _address(key: bytes) -> int:
    """Return the address of a function for given argument types; it is compiled where that has not been done."""
    address = _addresses.get(key)
    if address is None:
        name, packed = key.split(b" ")
        dispatcher = _known[name.decode()]
        arguments = pickle.loads(base64.b64decode(packed))
        dispatcher.compile(arguments)
        made = dispatcher.overloads[arguments]
        address = _addresses[key] = made.library.get_pointer_to_function(made.fndesc.llvm_func_name)
    return address


llvmlite.binding.add_symbol(SYMBOL, ctypes.cast(_bind, ctypes.c_void_p).value)


def set_apart(dispatcher, returns) -> None:
    """Make compiled callers reach a dispatcher by its address.

    Parameters
    ----------
    dispatcher : numba Dispatcher
    returns : numba type
        What the function returns: callers are compiled before it.
    """
    function = dispatcher.py_func
    name = f"{function.__module__}:{function.__qualname__}"
    _known[name] = dispatcher
    callees: dict = {}
    compile_it = dispatcher.compile

    def compile_as(signature):
        arguments, _ = sigutils.normalize_signature(signature)
        return compile_it(typing.signature(returns, *arguments))

    def get_call_template(args, keywords):
        pysig, args = dispatcher._compiler.fold_argument_types(args, keywords)
        args = tuple(types.unliteral(arg) for arg in args)
        template = typing.make_concrete_template(f"Apart({name})", key=name, signatures=[typing.signature(returns, *args)])
        return template, pysig, args, {}

    def get_overload(signature):
        arguments, _ = sigutils.normalize_signature(signature)
        if arguments not in callees:
            callees[arguments] = _Callee()
            key = f"{name} {base64.b64encode(pickle.dumps(arguments)).decode()}"
            dispatcher.targetctx.insert_func_defn([(_caller(key), callees[arguments], arguments)])
        return callees[arguments]

    dispatcher.compile, dispatcher.get_call_template, dispatcher.get_overload = compile_as, get_call_template, get_overload


def refuse_python(dispatcher) -> None:
    """Make calls from Python an error, of a dispatcher whose functions are compiled without what unpacks arguments."""
    def add_overload(made):
        dispatcher.overloads[tuple(made.signature.args)] = made  # unknown to the part of numba that calls without asking

    def call(*arguments, **keywords):
        raise TypeError(f"{dispatcher.py_func.__qualname__} has no door for Python: make it apart(..., python=True)")

    dispatcher.add_overload, dispatcher._compile_for_args = add_overload, call


class _Callee:
    """Stands for a function and its argument types where numba looks up how a call is written."""


def _caller(key: str):
    """Return what writes a call of the function behind a key."""
    text = key.encode() + b"\0"

    def write(context, builder, signature, values):
        module = builder.module
        kind = context.call_conv.get_function_type(signature.return_type, signature.args).as_pointer()
        own = f"apart_{zlib.crc32(text):x}"
        if own in module.globals:
            cell = module.globals[own]
        else:
            cell = cgutils.add_global_variable(module, kind, own)
            cell.linkage, cell.initializer = "internal", ir.Constant(kind, None)
        known = builder.load_atomic(cell, "monotonic", 8)
        before = builder.block
        with cgutils.if_unlikely(builder, cgutils.is_null(builder, known)):
            word = ir.IntType(8).as_pointer()
            bind = cgutils.get_or_insert_function(module, ir.FunctionType(word, [word]), SYMBOL)
            found = builder.bitcast(builder.call(bind, [context.insert_const_bytes(module, text, own + "_key")]), kind)
            with cgutils.if_unlikely(builder, cgutils.is_null(builder, found)):
                context.call_conv.return_user_exc(builder, NotCompiled, (f"{key.split(' ')[0]} could not be compiled",))
            builder.store_atomic(found, cell, "monotonic", 8)
            asked = builder.block
        address = builder.phi(kind)
        address.add_incoming(known, before)
        address.add_incoming(found, asked)
        status, out = context.call_conv.call_function(builder, address, signature.return_type, signature.args, values)
        with cgutils.if_unlikely(builder, status.is_error):
            context.call_conv.return_status_propagate(builder, status)
        return out

    return write
