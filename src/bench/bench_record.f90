!> Results of the benchmark as a list of records.
module bench_record
  use kinds, only: wp
  implicit none
  private

  public :: add_record, keep_least, find_record

  !> One measurement. Negative numbers stand for what is not known.
  type, public :: record_t
    character(:), allocatable :: name
    integer :: threads = 1
    real(wp) :: ns = 0.0_wp                   !! least of all repetitions, per unit [ns]
    real(wp) :: median = 0.0_wp               !! of all repetitions [ns]
    real(wp) :: spread = 0.0_wp               !! (median - least)/least
    integer :: repetitions = 0
    character(:), allocatable :: per          !! the unit: element-step, point, byte ...
    real(wp) :: ns_per_point = -1.0_wp        !! per integration point
    real(wp) :: flops = -1.0_wp               !! operations a unit, by formula
    real(wp) :: bytes = -1.0_wp               !! moved a unit, by formula
    real(wp) :: working_set = -1.0_wp         !! touched over and over [byte]
    real(wp) :: memory_ratio = -1.0_wp        !! memory held over that of the state alone
  end type record_t

  !> A list that grows.
  type, public :: record_list_t
    integer :: n = 0
    type(record_t), allocatable :: items(:)   !! the first `n` are set
  end type record_list_t

contains

  !> Append a record.
  subroutine add_record(list, record)
    type(record_list_t), intent(inout) :: list
    type(record_t), intent(in) :: record
    type(record_t), allocatable :: wider(:)
    integer :: i

    if (.not. allocated(list%items)) allocate (list%items(32))
    if (list%n == size(list%items)) then
      allocate (wider(2*list%n))
      do i = 1, list%n
        wider(i) = list%items(i)
      end do
      call move_alloc(wider, list%items)
    end if
    list%n = list%n + 1
    list%items(list%n) = record
  end subroutine add_record

  !> Append a record, or merge it with the one of its name and threads: the least of both times, the
  !! mean of both medians, weighted by the repetitions.
  subroutine keep_least(list, record)
    type(record_list_t), intent(inout) :: list
    type(record_t), intent(in) :: record
    type(record_t) :: merged
    integer :: i, n

    i = find_record(list, record%name, record%threads)
    if (i == 0) then
      call add_record(list, record)
      return
    end if
    merged = record
    associate (before => list%items(i))
      n = before%repetitions + record%repetitions
      if (before%ns < record%ns) merged = before
      merged%median = (before%median*before%repetitions + record%median*record%repetitions)/n
      merged%repetitions = n
      merged%spread = max(0.0_wp, merged%median/merged%ns - 1.0_wp)
    end associate
    list%items(i) = merged
  end subroutine keep_least

  !> Index of the record of this name and number of threads, 0: there is none.
  pure integer function find_record(list, name, threads) result(found)
    type(record_list_t), intent(in) :: list
    character(*), intent(in) :: name
    integer, intent(in) :: threads

    do found = list%n, 1, -1
      if (list%items(found)%name == name .and. list%items(found)%threads == threads) return
    end do
  end function find_record

end module bench_record
