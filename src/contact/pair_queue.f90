!> Pairs of numbers in the order of their bounds, the lowest first: a binary heap.
module pair_queue
  use kinds, only: wp
  implicit none
  private

  public :: pair_t, pair_queue_t, push_pair, pop_pair, lowest_bound

  !> Two nodes and how near they may be.
  type :: pair_t
    real(wp) :: bound = 0.0_wp           !! they are no nearer [length]
    real(wp) :: across(3) = 0.0_wp       !! unit vector along which that holds
    integer :: nodes(2) = 0
  end type pair_t

  !> The first `n` of `items`; of items i and 2 i or 2 i + 1 the former is not above the latter.
  type :: pair_queue_t
    integer :: n = 0
    type(pair_t), allocatable :: items(:)
  end type pair_queue_t

contains

  !> Bound of the first pair; huge if there is none.
  pure real(wp) function lowest_bound(queue) result(bound)
    type(pair_queue_t), intent(in) :: queue

    bound = huge(1.0_wp)
    if (queue%n > 0) bound = queue%items(1)%bound
  end function lowest_bound

  !> Add a pair.
  pure subroutine push_pair(queue, pair)
    type(pair_queue_t), intent(inout) :: queue
    type(pair_t), intent(in) :: pair
    type(pair_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(queue%items)) allocate (queue%items(64))
    if (queue%n == size(queue%items)) then
      allocate (longer(2*queue%n))
      longer(:queue%n) = queue%items
      call move_alloc(longer, queue%items)
    end if
    queue%n = queue%n + 1
    i = queue%n
    do while (i > 1)
      if (queue%items(i/2)%bound <= pair%bound) exit
      queue%items(i) = queue%items(i/2)
      i = i/2
    end do
    queue%items(i) = pair
  end subroutine push_pair

  !> Take the pair with the lowest bound out of a queue that is not empty.
  pure subroutine pop_pair(queue, pair)
    type(pair_queue_t), intent(inout) :: queue
    type(pair_t), intent(out) :: pair
    type(pair_t) :: last
    integer :: i, child

    pair = queue%items(1)
    last = queue%items(queue%n)
    queue%n = queue%n - 1
    i = 1
    do
      child = 2*i
      if (child > queue%n) exit
      if (child < queue%n) then
        if (queue%items(child + 1)%bound < queue%items(child)%bound) child = child + 1
      end if
      if (last%bound <= queue%items(child)%bound) exit
      queue%items(i) = queue%items(child)
      i = child
    end do
    if (queue%n > 0) queue%items(i) = last
  end subroutine pop_pair

end module pair_queue
