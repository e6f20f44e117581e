cimport cython
from libc.stdint cimport int32_t, int64_t, uint8_t

cdef extern from "math.h" nogil:
    cpdef double atan2(double, double)
    cpdef double ceil(double)
    cpdef double sqrt(double)

@cython.locals(n=int64_t, known=int64_t, least=int64_t, widths=int64_t, letters=int64_t, letter=int64_t, row=int64_t, shape=int64_t, number=int64_t, slot=int64_t, step=double)
cpdef int64_t followed(
    const double[::1] numbers, const int64_t[::1] first, const int32_t[::1] shapes,
    const int64_t[:, ::1] slots, const int64_t[::1] feeds, const int64_t[::1] motions, const int64_t[::1] masks,
    const double[::1] position, double unit, double feed, double motion,
    const double[::1] offset, const double[::1] scale, bint incremental,
    double[:, ::1] path, double[::1] feed_of, uint8_t[::1] fed, double[::1] motion_of, uint8_t[::1] coded,
    int64_t[::1] mask,
) except -1 nogil

cdef double TURN

@cython.locals(n=int64_t, row=int64_t, begin=double, end=double, angle=double)
cpdef int64_t sweeps(
    const double[:, ::1] centre, const double[:, ::1] step, const uint8_t[::1] clockwise, double fuzz, double[::1] out
) except -1 nogil

@cython.locals(most=double, share=double, square=double, off=double, here=double, node=int64_t, seen=int64_t, i=int64_t, j=int64_t)
cdef double deviation(
    const double[::1] fraction, const double[:, ::1] command, const double[:, :, ::1] follow, int64_t a, int64_t b
) except? -1 nogil

@cython.locals(nodes=int64_t, first=int64_t, motion=int64_t, at=int64_t, last=int64_t, usual=int64_t, stop=int64_t, near=int64_t, far=int64_t, step=int64_t, trial=int64_t, reached=double, off=double, fresh=bint)
cpdef int64_t fewest(
    const int64_t[::1] counts, const double[::1] fraction, const double[:, ::1] command,
    const double[:, :, ::1] follow, double tolerance, int64_t stretch, uint8_t[::1] ends, double[::1] worst,
) except -1 nogil

@cython.locals(axes=int64_t, row=int64_t, before=int64_t, axis=int64_t, square=double, change=double, here=double, there=double, off=double, step=double, beyond=double)
cpdef bint within_limits(
    const double[:, ::1] meant, const double[:, ::1] done, const double[::1] low, const double[::1] high,
    const double[::1] most, const double[::1] linear, double together, double jump, double fuzz,
) except -1 nogil

@cython.locals(axes=int64_t, arm=double, most=double, axis=int64_t, row=int64_t, way=double, angle=double, shifting=double, turning=double, second=double, before=double, after=double, change=double, here=double, there=double, along=double, step=double, first=double, last=double, swing=double, leaning=double, bow=double)
cpdef int64_t bounds(
    const double[:, ::1] meant, const double[:, ::1] done, const double[::1] linear,
    const double[:, ::1] slopes, const double[:, ::1] curvatures,
    double moved, double turned, double least_arm, double more, double corner, double close, double[::1] bound,
) except -1 nogil

@cython.locals(n=int64_t, axes=int64_t, pieces=int64_t, rows=int64_t, widths=int64_t, right=bint, row=int64_t, piece=int64_t, axis=int64_t, i=int64_t, j=int64_t, bends=double, turns=double, chord=double, here=double, step=double, square=double, off=double, way=double, after=double)
cpdef int64_t at_ends(
    const double[:, ::1] start, const double[:, ::1] end, const double[::1] before_all,
    const double[:, ::1] written, const int64_t[::1] first, const double[:, ::1] wanted, const double[::1] before,
    const double[::1] features, const double[:, ::1] ways, const int64_t[::1] columns, const uint8_t[::1] linear,
    double straight, double turned, double density, double most,
    const uint8_t[::1] shown, uint8_t[::1] apart, const uint8_t[::1] followed,
    double[::1] sums, int64_t[::1] places, int64_t[::1] counts,
) except -1 nogil
