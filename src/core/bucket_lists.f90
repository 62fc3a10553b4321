!> Numbered things sorted into buckets, such as segments by the cells of a grid: one list for all
!! buckets, and where each begins in it.
module bucket_lists
  implicit none
  private

  public :: sort_into_buckets

contains

  !> Things of each bucket in their order, one bucket after the other: those of bucket b are
  !! list(begin(b):begin(b + 1) - 1). A thing lies in a range of buckets, in none where it is empty.
  pure subroutine sort_into_buckets(n_buckets, first, last, begin, list)
    integer, intent(in) :: n_buckets
    integer, intent(in) :: first(:), last(:)              !! buckets of each thing
    integer, allocatable, intent(out) :: begin(:)         !! shape (n_buckets + 1)
    integer, allocatable, intent(out) :: list(:)          !! numbers of things
    integer :: next(n_buckets), i, b

    allocate (begin(n_buckets + 1), source=0)
    begin(1) = 1
    do i = 1, size(first)
      begin(first(i) + 1:last(i) + 1) = begin(first(i) + 1:last(i) + 1) + 1
    end do
    do b = 1, n_buckets
      begin(b + 1) = begin(b) + begin(b + 1)
    end do
    allocate (list(begin(n_buckets + 1) - 1))
    next = begin(:n_buckets)
    do i = 1, size(first)
      do b = first(i), last(i)
        list(next(b)) = i
        next(b) = next(b) + 1
      end do
    end do
  end subroutine sort_into_buckets

end module bucket_lists
