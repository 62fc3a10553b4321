!> The processes that work one scene, and what passes between them.
!!
!! `ranks_t` itself stands for a program that is alone: nothing passes. Programs that share a scene
!! extend it (see `mpi_ranks`). All processes call its procedures in the same order, with the
!! same number of values where nothing else is said.
!!
!! Values are handed over as they are and never added up here: sums are taken by whoever needs them,
!! in an order that does not depend on the number of processes.
module ranks
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t
  use timer, only: clock_ticks
  use parcel, only: parcel_t, empty_parcel
  implicit none
  private

  public :: share_error, is_first, first_says, gather_counted, gather_parcels, pass_counted, &
            sum_traffic

  !> What an exchange has cost so far.
  type, public :: traffic_t
    integer(int64) :: n_calls = 0
    integer(int64) :: n_values = 0     !! that have come here
    integer(int64) :: ticks = 0        !! of the clock, waiting for the others included
  end type traffic_t

  !> A process among all.
  type, public :: ranks_t
    integer :: number = 0       !! of this one, from 0 on
    integer :: n = 1            !! of all
  contains
    procedure :: gather => gather_alone
    procedure :: pass => pass_alone
    procedure :: share => share_alone
    procedure :: share_text => share_text_alone
    procedure :: largest => largest_alone
    procedure :: wait => wait_alone
    procedure :: host => host_alone
    procedure :: give_up => give_up_alone
  end type ranks_t

contains

  !> Is this the process that writes files and the terminal for all, or the only one?
  pure logical function is_first(ranks)
    class(ranks_t), intent(in), optional :: ranks      !! absent: there is but one

    is_first = .true.
    if (present(ranks)) is_first = ranks%number == 0
  end function is_first

  !> What the first process answers, who alone has to know.
  logical function first_says(ranks, answer) result(is_so)
    class(ranks_t), intent(in), optional :: ranks      !! likewise
    logical, intent(in) :: answer                      !! of the others nothing
    real(wp) :: values(1)

    is_so = answer
    if (.not. present(ranks)) return
    values = merge(1.0_wp, 0.0_wp, answer)
    call ranks%share(values, 0)
    is_so = values(1) > 0.5_wp
  end function first_says

  !> A failure of one process is one of all; where several fail, that of the lowest number.
  subroutine share_error(ranks, error)
    class(ranks_t), intent(in) :: ranks
    type(error_t), allocatable, intent(inout) :: error
    character(:), allocatable :: message
    integer :: failed

    if (ranks%n == 1) return
    failed = ranks%n - ranks%largest(merge(ranks%n - ranks%number, 0, allocated(error)))
    if (failed == ranks%n) return
    message = ""
    if (allocated(error)) message = error%message
    call ranks%share_text(message, failed)
    if (.not. allocated(error)) allocate (error)
    error%message = message
  end subroutine share_error

  !> Add what an exchange has cost.
  pure subroutine sum_traffic(part, total)
    type(traffic_t), intent(in) :: part
    type(traffic_t), intent(inout) :: total

    total%n_calls = total%n_calls + part%n_calls
    total%n_values = total%n_values + part%n_values
    total%ticks = total%ticks + part%ticks
  end subroutine sum_traffic

  !> Gather values at all processes, and count what that costs.
  subroutine gather_counted(ranks, counts, own, joined, traffic)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: counts(:)
    real(wp), intent(in), contiguous :: own(:)
    real(wp), intent(inout), contiguous :: joined(:)
    type(traffic_t), intent(inout) :: traffic
    integer(int64) :: start

    start = clock_ticks()
    call ranks%gather(counts, own, joined, .true.)
    traffic%ticks = traffic%ticks + clock_ticks() - start
    traffic%n_values = traffic%n_values + sum(int(counts, int64)) - counts(ranks%number + 1)
    traffic%n_calls = traffic%n_calls + 1
  end subroutine gather_counted

  !> The parcels of all processes as one, in the order of their numbers.
  subroutine gather_parcels(ranks, own, joined, traffic)
    class(ranks_t), intent(in) :: ranks
    type(parcel_t), intent(in) :: own
    type(parcel_t), intent(inout) :: joined
    type(traffic_t), intent(inout) :: traffic
    real(wp) :: counts(ranks%n)

    call ranks%gather(spread(1, 1, ranks%n), [real(own%n, wp)], counts, .true.)
    call empty_parcel(joined, nint(sum(counts)))
    call gather_counted(ranks, nint(counts), own%values, joined%values, traffic)
    joined%n = nint(sum(counts))
  end subroutine gather_parcels

  !> Pass parcels, and count what that costs.
  subroutine pass_counted(ranks, partners, sent, received, traffic)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: partners(:)
    type(parcel_t), intent(in), asynchronous :: sent(:)
    type(parcel_t), intent(inout) :: received(:)
    type(traffic_t), intent(inout) :: traffic
    integer(int64) :: start

    start = clock_ticks()
    call ranks%pass(partners, sent, received)
    traffic%ticks = traffic%ticks + clock_ticks() - start
    traffic%n_values = traffic%n_values + sum(int(received(:size(partners))%n, int64))
  end subroutine pass_counted

  !> The values of all processes, one after the other in the order of their numbers; at the first
  !! one alone, or at all.
  subroutine gather_alone(self, counts, own, joined, is_everywhere)
    class(ranks_t), intent(in) :: self
    integer, intent(in) :: counts(:)            !! values of each process
    real(wp), intent(in), contiguous :: own(:)  !! of this process, as many or more
    real(wp), intent(inout), contiguous :: joined(:)   !! where nothing arrives it stays as it is
    logical, intent(in) :: is_everywhere

    joined(:counts(1)) = own(:counts(1))
  end subroutine gather_alone

  !> Send a parcel to each partner, and receive one from each. Partners are so mutually.
  subroutine pass_alone(self, partners, sent, received)
    class(ranks_t), intent(in) :: self
    integer, intent(in) :: partners(:)                 !! numbers of other processes
    type(parcel_t), intent(in), asynchronous :: sent(:)   !! to each of them
    type(parcel_t), intent(inout) :: received(:)       !! likewise; nothing is taken of them yet
  end subroutine pass_alone

  !> The values of one process to all others.
  subroutine share_alone(self, values, from)
    class(ranks_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: values(:)
    integer, intent(in) :: from                 !! number of the process
  end subroutine share_alone

  !> The text of one process to all others.
  subroutine share_text_alone(self, text, from)
    class(ranks_t), intent(in) :: self
    character(:), allocatable, intent(inout) :: text
    integer, intent(in) :: from
  end subroutine share_text_alone

  !> The largest of one number of each process.
  integer function largest_alone(self, value) result(largest)
    class(ranks_t), intent(in) :: self
    integer, intent(in) :: value

    largest = value
  end function largest_alone

  !> Go on when all processes have come so far.
  subroutine wait_alone(self)
    class(ranks_t), intent(in) :: self
  end subroutine wait_alone

  !> Name of the machine that a process runs on; empty where that does not matter.
  function host_alone(self) result(name)
    class(ranks_t), intent(in) :: self
    character(:), allocatable :: name

    name = ""
  end function host_alone

  !> This process cannot go on: so none of the others can. Alone it has to end by itself.
  subroutine give_up_alone(self, code)
    class(ranks_t), intent(in) :: self
    integer, intent(in) :: code      !! with which all end
  end subroutine give_up_alone

end module ranks
