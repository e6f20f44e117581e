cimport cython
from libc.stdint cimport int32_t, int64_t, uint8_t, uint64_t

from ncfix.core.edits cimport EditBuffer

cdef extern from "math.h" nogil:
    cpdef double copysign(double, double)
    cpdef double sqrt(double)

cdef int64_t POINT, ZERO, MINUS, PLUS, VECTOR_HEAD, MOST_STEPS, ROOM
cdef double SEMICIRCLE, CLOSE_CALL, inf

@cython.final
cdef class NumberRules:
    cdef const double[::1] powers
    cdef int64_t longest, decimals
    cdef readonly int64_t room
    cdef double largest, tie, rounded

@cython.final
cdef class CentreWords:
    cdef const int64_t[:, ::1] slots
    cdef const uint8_t[:, :, ::1] heads
    cdef const int64_t[::1] radius
    cdef const int64_t[:, :, ::1] taken

@cython.final
cdef class WordPrinter:
    cdef NumberRules rules
    cdef EditBuffer into
    cdef const uint8_t[::1] text
    cdef const int64_t[:, ::1] edges
    cdef const int64_t[::1] first
    cdef const int32_t[::1] template
    cdef const double[::1] values
    cdef const int64_t[:, ::1] spans
    cdef const int64_t[:, ::1] slots
    cdef const int64_t[:, ::1] by_place
    cdef const int64_t[::1] by_letter
    cdef const int64_t[:, ::1] anchors
    cdef const uint8_t[:, :, ::1] heads
    cdef const int64_t[:, ::1] leads
    cdef const uint8_t[:, ::1] openings
    cdef const uint8_t[:, ::1] closings
    cdef const uint8_t[::1] line_end
    cdef const double[::1] offset
    cdef const double[::1] scale
    cdef const int64_t[::1] least
    cdef const double[::1] half
    cdef double[::1] here
    cdef double[::1] wanted
    cdef double[::1] now
    cdef int64_t[::1] told
    cdef bint signed, point, plus
    cdef int64_t own, whole
    cdef double read

    @cython.locals(axes=int64_t, row=int64_t, axis=int64_t, piece=int64_t, block=int64_t, shape=int64_t, number=int64_t, several=bint, clear=bint, place=int64_t, lead=int64_t, begun=int64_t, count=int64_t, size=int64_t, done=int64_t, first_piece=int64_t, last_piece=int64_t)
    cpdef int64_t write(
        self, const int32_t[::1] rows, const double[:, ::1] ends, const int64_t[::1] pieces, double[:, ::1] commands
    ) except -1 nogil
    @cython.locals(text=int64_t, begin=int64_t, end=int64_t, axis=int64_t, word=int64_t, first=int64_t, last=int64_t)
    cdef inline bint fits(self, int64_t block, int64_t shape, int64_t number) except -1 nogil
    @cython.locals(lead=int64_t, around=int64_t)
    cdef inline int64_t most(self, int64_t block, int64_t shape, int64_t number, int64_t further) except -1 nogil
    cdef inline int64_t arrive(self, double[:, ::1] commands, int64_t piece) except -1 nogil
    @cython.locals(place=int64_t)
    cdef inline int64_t place_of(self, int64_t slot, int64_t beyond, int64_t block, int64_t number) except -1 nogil
    @cython.locals(axis=int64_t, word=int64_t, begun=int64_t, begin=int64_t, end=int64_t, k=int64_t)
    cdef inline bint rewrite_words(self, int64_t number, int64_t shape, bint several) except -1 nogil
    @cython.locals(axis=int64_t, begun=int64_t, off=double, k=int64_t, blank=int64_t, letter=int64_t)
    cdef inline bint add_words(self, int64_t place, int64_t shape) except -1 nogil
    @cython.locals(axis=int64_t, off=double, k=int64_t, at=int64_t, blank=int64_t, letter=int64_t, moved=bint)
    cdef bint put_line(self, int64_t lead_from, int64_t lead_to, int64_t shape) except -1 nogil
    @cython.locals(
        n=int64_t, right=bint, row=int64_t, block=int64_t, count=int64_t, size=int64_t, shape=int64_t,
        number=int64_t, k=int64_t, kept=bint, certain=bint, limit=double, off=double, axis=int64_t, word=int64_t,
        base=double, wanted=double, begun=int64_t, first=int64_t, last=int64_t, blank=int64_t, letter=int64_t,
    )
    cpdef int64_t write_centres(
        self, const int32_t[::1] rows, const int64_t[:, ::1] plane, const int64_t[::1] spatial,
        const double[:, :, ::1] places, CentreWords words, double[:, ::1] centre, uint8_t[::1] clear,
    ) except -1 nogil
    @cython.locals(word=int64_t)
    cdef inline bint is_number(self, int64_t number, int64_t slot) except -1 nogil
    @cython.locals(
        x=double, y=double, half_chord=double, rise=double, nearest=double, side=int64_t, sign=double, u=double,
        v=double, off_x=double, off_y=double, off=double,
    )
    cdef double centre_by_radius(
        self, double radius, const double[:, :, ::1] places, int64_t row, double[:, ::1] centre
    ) except -2 nogil
    @cython.locals(steps=int64_t, sign=int64_t, negative=bint)
    cdef bint put_new(self, double value, int64_t decimals, int64_t blank, int64_t letter) except -1 nogil
    @cython.locals(most=int64_t, steps=int64_t, sign=int64_t, digits=int64_t)
    cdef inline bint put_in_style(self, int64_t start, int64_t stop, double value, int64_t least) except -1 nogil
    @cython.locals(head=int64_t, character=int64_t, first=int64_t, point=int64_t, place=int64_t)
    cdef inline bint style_of(self, int64_t start, int64_t stop) except -1 nogil
    @cython.locals(size=double, rest=double, steps=int64_t)
    cdef inline int64_t steps_of(self, double value, int64_t decimals) except -2 nogil
    @cython.locals(at=int64_t, count=int64_t, rest=uint64_t, digits=int64_t, length=int64_t, k=int64_t, pointed=bint)
    cdef inline int64_t put(
        self, int64_t steps, int64_t decimals, int64_t sign, int64_t least, bint point
    ) except -1 nogil
