cimport cython
from libc.stdint cimport int64_t, uint8_t

@cython.locals(at=int64_t, done=int64_t, taken=int64_t, begin=int64_t, end=int64_t, more=int64_t, k=int64_t, edit=int64_t, last=bint)
cpdef int64_t spliced(
    const uint8_t[::1] source, const int64_t[::1] start, const int64_t[::1] stop, const int64_t[::1] length,
    const uint8_t[::1] data, uint8_t[::1] out,
) except -1 nogil

@cython.locals(at=int64_t, to=int64_t, begin=int64_t, end=int64_t, more=int64_t, k=int64_t, edit=int64_t, last=bint, different=uint8_t)
cpdef bint left_alone(
    const uint8_t[::1] old, const uint8_t[::1] new,
    const int64_t[::1] start, const int64_t[::1] stop, const int64_t[::1] length,
) except -1 nogil
