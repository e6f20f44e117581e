cimport cython
from libc.stdint cimport int64_t

from ncfix.core.chain cimport PoseBatch, RouteSteps

cdef extern from "math.h" nogil:
    cpdef double sqrt(double)

cdef double inf
cdef int64_t BATCH, SHIFT, TURN, PARTS

@cython.locals(n=int64_t, tip=int64_t, point=int64_t, before=int64_t, ahead=int64_t, begin=int64_t, count=int64_t, i=int64_t, k=int64_t, used=int64_t, left=int64_t, number=int64_t, right=bint)
cpdef int64_t aim(
    RouteSteps perfect, RouteSteps within, RouteSteps behind, PoseBatch batch, const int64_t[::1] axes,
    const double[:, ::1] target, double close, double flat, int64_t passes, double[:, ::1] out,
) except -1 nogil
@cython.locals(point=int64_t, back=int64_t, before=int64_t, whole=int64_t, total=int64_t, left=int64_t, i=int64_t, k=int64_t, possible=bint, share=double)
cdef int64_t set_out(RouteSteps steps, const int64_t[::1] axes, PoseBatch batch, int64_t count, double flat) except -1 nogil
@cython.locals(gap=int64_t, point=int64_t, back=int64_t, last=int64_t, arrived=int64_t, i=int64_t, k=int64_t, q=int64_t, row=int64_t, before=double)
cdef int64_t step_closer(
    const int64_t[::1] axes, double close, bint begins, PoseBatch batch, int64_t count, int64_t begin, double[:, ::1] out
) except -1 nogil
@cython.locals(tip=int64_t, point=int64_t, n=int64_t, first=int64_t, begin=int64_t, count=int64_t, i=int64_t, k=int64_t, axis=int64_t, j=int64_t, right=bint)
cpdef int64_t placed(
    RouteSteps perfect, PoseBatch batch, const int64_t[::1] axes, const double[:, ::1] ways_back,
    const double[:, ::1] target, double[:, ::1] out,
) except -1 nogil
cdef bint is_one_of(int64_t axis, const int64_t[::1] axes) noexcept nogil
