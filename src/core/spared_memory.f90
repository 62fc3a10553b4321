!> Memory for numbers that are held elsewhere: it is not taken from the system before it is used,
!! and goes back to it.
module spared_memory
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t, c_loc, c_size_t
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use state_store, only: visitor_t
  implicit none
  private

  public :: clear

  !> Of all tables that it visits the columns that are not held here are given up: they are zero
  !! from then on, or as they were, and take no memory until somebody writes them.
  type, extends(visitor_t), public :: sparing_t
  contains
    procedure :: visit => spare_others
  end type sparing_t

  interface
    integer(c_int) function c_page_size() bind(C, name="getpagesize")
      import :: c_int
    end function c_page_size

    integer(c_int) function c_madvise(address, n_bytes, advice) bind(C, name="madvise")
      import :: c_int, c_intptr_t, c_size_t
      integer(c_intptr_t), value :: address
      integer(c_size_t), value :: n_bytes
      integer(c_int), value :: advice
    end function c_madvise
  end interface

contains

  subroutine spare_others(self, n, n_columns, columns, values)
    class(sparing_t), intent(inout) :: self
    integer, intent(in) :: n, n_columns, columns(:)
    real(wp), intent(inout) :: values(n, n_columns)
    integer :: i, before, next

    before = 0
    do i = 1, size(columns) + 1
      next = n_columns + 1
      if (i <= size(columns)) next = columns(i)
      if (next > before + 1) call give_back(n*(next - before - 1), values(:, before + 1:next - 1))
      before = next
    end do
  end subroutine spare_others

  !> Zeros in what was just allocated. Memory fresh from the system has them, and only what is
  !! written takes room: so it is looked at, piece by piece.
  pure subroutine clear(n, values)
    integer, intent(in) :: n
    real(wp), intent(inout) :: values(n)
    integer, parameter :: piece = 512
    integer :: first, last

    do first = 1, n, piece
      last = min(first + piece - 1, n)
      ! By bits, for the zeros must have a sign.
      if (any(transfer(values(first:last), [0_int64]) /= 0_int64)) values(first:last) = 0.0_wp
    end do
  end subroutine clear

  !> The pages that lie within some numbers.
  subroutine give_back(n, values)
    integer, intent(in) :: n
    real(wp), intent(inout), target :: values(n)
    integer(c_int), parameter :: dont_need = 4_c_int   ! of Linux
    integer(c_intptr_t) :: first, last, page
    integer(c_int) :: ignored

    page = c_page_size()
    first = transfer(c_loc(values), first)
    last = (first + n*int(storage_size(values)/8, c_intptr_t))/page*page
    first = (first + page - 1)/page*page
    if (last > first) ignored = c_madvise(first, int(last - first, c_size_t), dont_need)
  end subroutine give_back

end module spared_memory
