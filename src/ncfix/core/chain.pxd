cimport cython
from libc.stdint cimport int64_t

cdef int64_t BATCH, SPARE, SHIFT, TURN, FORTH, BACK, POWERS, WAVES, GIVEN, PARTS

@cython.final
cdef class RouteSteps:
    cdef const double[::1] start
    cdef const int64_t[::1] kind
    cdef const int64_t[::1] axis
    cdef const double[::1] direction
    cdef const double[::1] point
    cdef const double[::1] center
    cdef const int64_t[::1] small
    cdef const int64_t[::1] rotates
    cdef const int64_t[::1] screws
    cdef const int64_t[::1] family
    cdef const int64_t[::1] signal_axis
    cdef const double[::1] signal
    cdef const int64_t[::1] first
    cdef const int64_t[::1] order
    cdef const int64_t[::1] part
    cdef const int64_t[::1] function
    cdef const double[::1] gain
    cdef readonly int64_t steps, functions, axes, turns, given

    cdef int64_t set_off(self, PoseBatch batch, int64_t count, int64_t tip) except -1 nogil
    @cython.locals(i=int64_t, k=int64_t, kind=int64_t, axis=int64_t, j=int64_t, at=int64_t)
    cdef int64_t carry(self, PoseBatch batch, int64_t count, int64_t tip, int64_t values, int64_t stop) except -1 nogil
    @cython.locals(j=int64_t, sine=int64_t, versine=int64_t)
    cdef int64_t turn(self, PoseBatch batch, int64_t i, int64_t count, int64_t tip, double sense) except -1 nogil
    cdef int64_t nudge_forth(self, PoseBatch batch, int64_t i, int64_t count, int64_t tip, int64_t at) except -1 nogil
    cdef int64_t nudge_back(self, PoseBatch batch, int64_t i, int64_t count, int64_t tip, int64_t at) except -1 nogil
    @cython.locals(j=int64_t, axis=int64_t, forth=bint, k=int64_t, sine=double, versine=double, x=double, y=double, z=double, u=double, v=double, w=double, a=double, b=double, c=double, t0=double, t1=double, t2=double, s=double, first=double, second=double, third=double, ax=double, ay=double, az=double, ox=double, oy=double, oz=double, tx=double, ty=double, tz=double)
    cdef int64_t screw(self, PoseBatch batch, int64_t i, int64_t count, int64_t tip, int64_t at) except -1 nogil
    cdef int64_t set_goal(
        self, PoseBatch batch, int64_t count, const double[:, ::1] target, int64_t begin, int64_t point
    ) except -1 nogil
    @cython.locals(found=int64_t, last=int64_t, part=int64_t, function=int64_t, gain=double, g=int64_t, f=int64_t, t=int64_t)
    cdef int64_t work_out(self, PoseBatch batch, int64_t count, int64_t used, int64_t values) except -1 nogil
    @cython.locals(u=int64_t, value=int64_t, axis=int64_t, at=int64_t, power=int64_t, f=int64_t, order=int64_t, row=int64_t)
    cdef int64_t powers(self, PoseBatch batch, int64_t g, int64_t count) except -1 nogil
    @cython.locals(tip=int64_t, axis=int64_t, order=int64_t, sine=int64_t, versine=int64_t, f=int64_t, row=int64_t)
    cdef int64_t waves(self, PoseBatch batch, int64_t g, int64_t count) except -1 nogil
    @cython.locals(found=bint, i=int64_t, axis=int64_t, j=int64_t, sine=int64_t, versine=int64_t)
    cdef int64_t follow(self, PoseBatch batch, int64_t column, int64_t count, int64_t way) except -1 nogil

@cython.final
cdef class PoseBatch:
    cdef const double[:, ::1] q
    cdef const double[:, ::1] sines
    cdef const double[:, ::1] versines
    cdef const double[:, ::1] given
    cdef const double[::1] lengths
    cdef double[:, ::1] work
    cdef readonly int64_t n, sine, versine, others, found, values, tip, length, spare

    @cython.locals(rows=bint)
    cdef bint fits(self, RouteSteps route, int64_t given) except -1 nogil
    cdef int64_t take_up(self, int64_t begin, int64_t count) except -1 nogil

cpdef int64_t rows_for(int64_t axes, int64_t turns, int64_t others, int64_t functions, int64_t small)

@cython.locals(begin=int64_t, count=int64_t, i=int64_t, k=int64_t)
cpdef int64_t tips(RouteSteps route, PoseBatch batch, double[:, ::1] out) except -1 nogil
@cython.locals(n=int64_t, tip=int64_t, point=int64_t, begin=int64_t, count=int64_t, i=int64_t, k=int64_t, side=int64_t, right=bint)
cpdef int64_t gaps(
    RouteSteps perfect, RouteSteps real, PoseBatch batch, const double[:, ::1] target, const int64_t[::1] sides,
    double[:, :, ::1] out, double[:, ::1] angle,
) except -1 nogil
