!> Processes of one machine whose messages come as late as through a slower network: each is held
!! back until its latency is over and its bytes have had their time since it was sent. A gather of n
!! processes has the latency log2(n) times.
module delayed_ranks
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use timer, only: clock_ticks, ticks_to_seconds
  use parcel, only: parcel_t, pass_values
  use mpi_ranks, only: mpi_ranks_t
  implicit none
  private

  type, extends(mpi_ranks_t), public :: delayed_ranks_t
    real(wp) :: latency = 0.0_wp       !! [s]
    real(wp) :: rate = huge(1.0_wp)    !! [byte/s]
  contains
    procedure :: gather
    procedure :: pass
    procedure :: share
  end type delayed_ranks_t

  real(wp), parameter :: n_bytes = 8.0_wp

contains

  subroutine gather(self, counts, own, joined, is_everywhere)
    class(delayed_ranks_t), intent(in) :: self
    integer, intent(in) :: counts(:)
    real(wp), intent(in), contiguous :: own(:)
    real(wp), intent(inout), contiguous :: joined(:)
    logical, intent(in) :: is_everywhere
    real(wp) :: all_values(sum(counts) + self%n), sent
    integer :: r, at, from

    associate (n => counts(self%number + 1))
      call self%mpi_ranks_t%gather(counts + 1, [own(:n), now()], all_values, is_everywhere)
      if (.not. is_everywhere .and. self%number > 0) return
      sent = 0.0_wp
      at = 0
      from = 0
      do r = 1, self%n
        joined(at + 1:at + counts(r)) = all_values(from + 1:from + counts(r))
        at = at + counts(r)
        from = from + counts(r) + 1
        sent = max(sent, all_values(from))
      end do
      call hold(sent + steps_of(self%n)*self%latency + n_bytes*(at - n)/self%rate)
    end associate
  end subroutine gather

  subroutine pass(self, partners, sent, received)
    class(delayed_ranks_t), intent(in) :: self
    integer, intent(in) :: partners(:)
    type(parcel_t), intent(in), asynchronous :: sent(:)
    type(parcel_t), intent(inout) :: received(:)
    type(parcel_t) :: stamped(size(partners))
    real(wp) :: stamp(1)
    integer :: i

    do i = 1, size(partners)
      stamped(i) = sent(i)
      stamp = now()
      call pass_values(stamped(i), .true., 1, stamp)
    end do
    call self%mpi_ranks_t%pass(partners, stamped, received)
    do i = 1, size(partners)
      associate (n => received(i)%n)
        call hold(received(i)%values(n) + self%latency + n_bytes*(n - 1)/self%rate)
        n = n - 1
      end associate
    end do
  end subroutine pass

  subroutine share(self, values, from)
    class(delayed_ranks_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: values(:)
    integer, intent(in) :: from

    call self%mpi_ranks_t%share(values, from)
    if (self%number /= from) call hold(now() + steps_of(self%n)*self%latency)
  end subroutine share

  !> Messages, one after the other, until all of n processes know of each other.
  pure integer function steps_of(n) result(steps)
    integer, intent(in) :: n

    steps = ceiling(log(real(n, wp))/log(2.0_wp) - 1.0e-9_wp)
  end function steps_of

  !> The clock that all processes of a machine have [s].
  real(wp) function now()
    now = ticks_to_seconds(clock_ticks())
  end function now

  !> Wait.
  subroutine hold(until)
    real(wp), intent(in) :: until      !! [s]
    integer(int64) :: n

    n = 0
    do while (now() < until)
      n = n + 1
    end do
  end subroutine hold

end module delayed_ranks
