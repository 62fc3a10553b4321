!> Processes for tests: the threads of a parallel region, which exchange what they have as processes
!! do. All of them call the same procedures in the same order.
module thread_ranks
  use omp_lib, only: omp_get_num_threads, omp_get_thread_num
  use kinds, only: wp
  use ranks, only: ranks_t
  use parcel, only: parcel_t
  implicit none
  private

  public :: thread_ranks_t, table_t, new_thread_ranks

  !> Where the threads put what the others get.
  type :: table_t
    real(wp), allocatable :: values(:)
    character(:), allocatable :: text
    integer :: largest = 0
    type(parcel_t), allocatable :: parcels(:, :)   !! from one to another, by their numbers
  end type table_t

  !> A thread among those of its region.
  type, extends(ranks_t) :: thread_ranks_t
    type(table_t), pointer :: table => null()
  contains
    procedure :: gather
    procedure :: pass
    procedure :: share_text
    procedure :: largest
  end type thread_ranks_t

contains

  !> To be called by each thread of a region.
  function new_thread_ranks(table) result(ranks)
    type(table_t), intent(inout), target :: table    !! one for all threads
    type(thread_ranks_t) :: ranks

    ranks%number = omp_get_thread_num()
    ranks%n = omp_get_num_threads()
    ranks%table => table
  end function new_thread_ranks

  subroutine gather(self, counts, own, joined, is_everywhere)
    class(thread_ranks_t), intent(in) :: self
    integer, intent(in) :: counts(:)
    real(wp), intent(in), contiguous :: own(:)
    real(wp), intent(inout), contiguous :: joined(:)
    logical, intent(in) :: is_everywhere

    !$omp single
    if (allocated(self%table%values)) deallocate (self%table%values)
    allocate (self%table%values(sum(counts)))
    !$omp end single
    associate (first => sum(counts(:self%number)), n => counts(self%number + 1))
      self%table%values(first + 1:first + n) = own(:n)
    end associate
    !$omp barrier
    if (is_everywhere .or. self%number == 0) joined(:sum(counts)) = self%table%values
    !$omp barrier
  end subroutine gather

  subroutine pass(self, partners, sent, received)
    class(thread_ranks_t), intent(in) :: self
    integer, intent(in) :: partners(:)
    type(parcel_t), intent(in), asynchronous :: sent(:)
    type(parcel_t), intent(inout) :: received(:)
    integer :: i

    !$omp single
    if (allocated(self%table%parcels)) deallocate (self%table%parcels)
    allocate (self%table%parcels(0:self%n - 1, 0:self%n - 1))
    !$omp end single
    do i = 1, size(partners)
      self%table%parcels(self%number, partners(i)) = sent(i)
    end do
    !$omp barrier
    do i = 1, size(partners)
      received(i) = self%table%parcels(partners(i), self%number)
      received(i)%n_taken = 0
    end do
    !$omp barrier
  end subroutine pass

  subroutine share_text(self, text, from)
    class(thread_ranks_t), intent(in) :: self
    character(:), allocatable, intent(inout) :: text
    integer, intent(in) :: from

    if (self%number == from) self%table%text = text
    !$omp barrier
    text = self%table%text
    !$omp barrier
  end subroutine share_text

  integer function largest(self, value)
    class(thread_ranks_t), intent(in) :: self
    integer, intent(in) :: value

    !$omp single
    self%table%largest = value
    !$omp end single
    !$omp critical (largest_of_threads)
    self%table%largest = max(self%table%largest, value)
    !$omp end critical (largest_of_threads)
    !$omp barrier
    largest = self%table%largest
    !$omp barrier
  end function largest

end module thread_ranks
