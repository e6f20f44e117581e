cimport cython
from libc.stdint cimport int64_t, uint8_t

cdef extern from "math.h" nogil:
    cpdef double sqrt(double)

@cython.final
cdef class CurveColumns:
    cdef const double[:, ::1] parabolas
    cdef const double[::1] lengths
    cdef const double[::1] ways
    cdef const uint8_t[::1] opens
    cdef const int64_t[::1] upto
    cdef const int64_t[::1] lying
    cdef double share, gap, push

    @cython.locals(low=int64_t, high=int64_t, middle=int64_t)
    cdef int64_t place(self, double way) except -1 nogil
    @cython.locals(at=int64_t, after=int64_t, end=double)
    cdef int64_t hop(self, int64_t piece, double push, bint one) except -1 nogil
    @cython.locals(x=double, y=double, z=double, u=double, v=double, w=double, square=double, size=double, ahead=double, bowed=double, outside=bint)
    cdef int64_t newton(
        self, double px, double py, double pz, int64_t k, double share, double close, int64_t steps
    ) except -1 nogil
    @cython.locals(row=int64_t, x=double, y=double, z=double, piece=int64_t, new=int64_t, start=double, share=double, gap=double, push=double, one=bint)
    cpdef int64_t down(
        self, const double[:, ::1] points, const double[::1] expected, double near, double close,
        int64_t steps, int64_t hops, int64_t[::1] pieces, double[::1] shares, double[::1] gaps,
    ) except -1 nogil
