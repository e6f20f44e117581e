cimport cython
from libc.stdint cimport int32_t, int64_t, uint8_t, uint64_t

cdef int64_t UNTOUCHED, CRAMPED, NONE, BROKEN, FREE, FIXED, LITERAL, NUMERIC, SIGN, COMMENT, ODD
cdef int64_t CHARACTER, CHILD, SIBLING, SHAPE, POINT, ZERO, NINE, MINUS, OPEN, CLOSE, TAIL

@cython.final
cdef class Scanner:
    cdef const uint8_t[::1] kinds
    cdef const uint8_t[::1] fixed
    cdef const uint8_t[::1] unsigned_after
    cdef const uint8_t[::1] blank
    cdef const double[::1] powers
    cdef int64_t blanks, digits, start, past, size
    cdef bint pointed
    cdef double value

    @cython.locals(n=int64_t, least=int64_t, block=int64_t, character=int64_t, kind=int64_t, past=int64_t, close=int64_t, form=int64_t, row=int64_t, place=int64_t, stop=int64_t, end=int64_t, count=int64_t, known=int64_t, row_at_sign=int64_t, end_at_sign=int64_t, latest=int64_t, guess=int64_t, found=int64_t, commented=bint)
    cpdef int64_t scan(
        self, const uint8_t[::1] text, const int64_t[:, ::1] blocks,
        int64_t number_mark, int64_t pointless_mark, int64_t comment_mark,
        int64_t[::1] group, int64_t[::1] comment, int64_t[::1] first, int64_t[:, ::1] spans, double[::1] values,
        uint8_t[::1] shapes, int64_t[::1] starts, int64_t[::1] behind, int32_t[:, ::1] tree,
    ) except -9 nogil

    @cython.locals(mark=int64_t, place=int64_t, digits=int64_t, signed=bint)
    cdef int64_t alike(
        self, const uint8_t[::1] text, int64_t begin, int64_t stop, uint8_t[::1] shapes, int64_t at, int64_t end,
        int64_t number_mark, int64_t pointless_mark, int64_t count, int64_t[:, ::1] spans, double[::1] values,
    ) except -9 nogil

    @cython.locals(mantissa=uint64_t, leader=int64_t, past=int64_t, point=int64_t, at=int64_t, further=int64_t, digits=int64_t, decimals=int64_t, points=int64_t)
    cdef inline int64_t number(self, const uint8_t[::1] text, int64_t place, int64_t stop) except -9 nogil
    cdef inline int64_t before(self, const uint8_t[::1] text, int64_t place) except -9 nogil
    @cython.locals(character=int64_t, tail=bint, at=int64_t)
    cdef int64_t comment_end(self, const uint8_t[::1] text, int64_t place, int64_t stop) except -9 nogil
    cdef bint is_last(self, const uint8_t[::1] text, int64_t place, int64_t stop) except -1 nogil
    @cython.locals(at=int64_t, new=int64_t)
    cdef inline int64_t child_row(self, int32_t[:, ::1] tree, int64_t row, int64_t character) except -9 nogil
