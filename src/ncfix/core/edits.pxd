cimport cython
from libc.stdint cimport int64_t, uint8_t

@cython.final
cdef class EditBuffer:
    cdef int64_t[::1] start
    cdef int64_t[::1] stop
    cdef int64_t[::1] length
    cdef uint8_t[::1] data
    cdef readonly int64_t count, size

    cdef bint has_room(self, int64_t edits, int64_t size) except -1 nogil
    cdef int64_t put(self, int64_t character) except -1 nogil
    cdef int64_t note(self, int64_t begin, int64_t end, int64_t size) except -1 nogil
    cdef int64_t back_to(self, int64_t count, int64_t size) except -1 nogil

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
