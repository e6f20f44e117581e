cimport cython
from libc.stdint cimport int64_t

@cython.locals(same=bint)
cdef bint fit(const double[:, :, ::1] moved, const double[::1] weight, double[:, :, ::1] out) noexcept nogil
@cython.locals(i=int64_t, k=int64_t)
cpdef int64_t advanced(
    const double[::1] d, const double[::1] p, const double[::1] sine, const double[::1] versine,
    const double[:, :, ::1] moved, const double[::1] weight, double[:, :, ::1] out,
) except -1 nogil
@cython.locals(i=int64_t, k=int64_t, n=int64_t, x=double, y=double, z=double, u=double, v=double, w=double, s=double, first=double, second=double, ax=double, ay=double, az=double, ox=double, oy=double, oz=double, tx=double, ty=double, tz=double, ex=double, ey=double, ez=double, weighed=double)
cpdef int64_t moved_small(
    const double[:, ::1] r, const double[:, ::1] t, const double[:, ::1] c, bint back,
    const double[:, :, ::1] moved, const double[::1] weight, double[:, :, ::1] out,
) except -1 nogil
@cython.locals(i=int64_t, k=int64_t)
cpdef int64_t turned(
    const double[::1] r, double first, double second, const double[::1] c,
    const double[:, :, ::1] moved, const double[::1] weight, double[:, :, ::1] out,
) except -1 nogil
