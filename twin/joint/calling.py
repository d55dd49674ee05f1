"""Calling a function by its address from compiled kernels.

The kernels are compiled once and kept on disk; a law that somebody brings along is compiled when it is loaded, and
reaches them as a number, the address of its machine code, at the price of an indirect call.
"""

import ctypes
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import typeof, types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from twin.arrays import Array

_NUMBERS = types.CPointer(types.float64)
SIGNATURE = types.void(_NUMBERS, types.intp, _NUMBERS, types.intp, types.float64, _NUMBERS)
"""Of such a function: a row of parameters and its length, a row of memory and its length, the coordinate, and two
numbers to fill, force and tangent."""

_DOUBLES = ctypes.POINTER(ctypes.c_double)
_PROTOTYPE = ctypes.CFUNCTYPE(
    None, _DOUBLES, ctypes.c_ssize_t, _DOUBLES, ctypes.c_ssize_t, ctypes.c_double, _DOUBLES
)  # fmt: skip


def call_at(address: int, p: Array, state: Array, row: int, e: float) -> tuple[float, float]:
    """What the function at an address fills in for one row of parameters `p` and memory `state` at `e`."""
    filled = (ctypes.c_double * 2)()
    numbers, memory = p[row], state[row]
    _PROTOTYPE(address)(
        numbers.ctypes.data_as(_DOUBLES), len(numbers), memory.ctypes.data_as(_DOUBLES), len(memory), e, filled
    )
    return filled[0], filled[1]


@overload(call_at)
def _compiled_call(address: Any, p: Any, state: Any, row: Any, e: Any) -> Callable[..., Any]:
    """The same inside kernels."""

    # numba compares the signatures, annotations and all
    def call(address: Any, p: Any, state: Any, row: Any, e: Any) -> Callable[..., Any]:
        return _indirect_call(address, p, state, row, e)

    return call


def _typed_call(typing: Any, address: Any, p: Any, state: Any, row: Any, e: Any) -> Any:
    signature = types.UniTuple(types.float64, 2)(types.int64, p, state, types.intp, types.float64)
    return signature, _written


_indirect_call: Any = intrinsic(_typed_call)


def _written(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Machine code of the call."""
    address, p, state, row, e = arguments
    double, length = ir.DoubleType(), context.get_value_type(types.intp)
    rows = [_row(context, builder, signature.args[1 + n], matrix, row) for n, matrix in enumerate((p, state))]
    filled = cgutils.alloca_once(builder, double, size=2)
    inputs = [double.as_pointer(), length] * 2 + [double, double.as_pointer()]
    function = builder.inttoptr(address, ir.FunctionType(ir.VoidType(), inputs).as_pointer())
    builder.call(function, [*rows[0], *rows[1], e, filled])
    values = [builder.load(builder.gep(filled, [ir.Constant(ir.IntType(32), n)])) for n in (0, 1)]
    return cgutils.pack_array(builder, values)


def _row(context: Any, builder: Any, kind: Any, matrix: Any, row: Any) -> tuple[Any, Any]:
    """Where a row of a matrix begins, and its length."""
    array = context.make_array(kind)(context, builder, matrix)
    stride = cgutils.unpack_tuple(builder, array.strides, 2)[0]
    begin = builder.gep(builder.bitcast(array.data, ir.IntType(8).as_pointer()), [builder.mul(row, stride)])
    return builder.bitcast(begin, ir.DoubleType().as_pointer()), cgutils.unpack_tuple(builder, array.shape, 2)[1]


def address(kernel: Any, *arguments: Any) -> int:
    """Where a kernel's machine code for arguments of these types begins, for :data:`call_kernel`."""
    kinds = tuple(typeof(argument) for argument in arguments)
    kernel.compile(kinds)
    compiled = kernel.overloads[kinds]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def _typed_kernel(typing: Any, address: Any, kernel: Any, arguments: Any) -> Any:
    result = kernel if kernel is types.none else kernel.get_call_type(typing, tuple(arguments), {}).return_type
    return result(types.int64, kernel, arguments), _written_kernel


call_kernel: Any = intrinsic(_typed_kernel)
"""Inside a kernel: what another one returns, given its address, itself and a tuple of its arguments.

None in place of one that returns nothing: it is compiled only where its address is asked for.
A kernel that is called by its name is copied into each that calls it and compiled again there.
"""


def _written_kernel(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Machine code of that call, as numba's own."""
    returned, kinds, convention = signature.return_type, tuple(signature.args[2]), context.call_conv
    function = builder.inttoptr(arguments[0], convention.get_function_type(returned, kinds).as_pointer())
    given = cgutils.unpack_tuple(builder, arguments[2])
    status, result = convention.call_function(builder, function, returned, kinds, given)
    with cgutils.if_unlikely(builder, status.is_error):
        convention.return_status_propagate(builder, status)
    return result
