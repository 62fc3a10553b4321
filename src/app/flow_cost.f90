!> What plastic flow adds to the cost of the blank's forces, measured with the model's own kernels
!! and its own law on a copy of the blank that is stretched until all of its points flow.
!!
!! Times are processor time of the calling thread: the caller sets the number of threads to one.
module flow_cost
  use kinds, only: wp
  use seams, only: seams_t
  use block_law, only: block_law_t
  use element, only: part_t, force_report_t
  use body_parts, only: forces_of_parts
  use blank, only: blank_t
  implicit none
  private

  public :: flow_seconds

  !> Strains of the stretch: from the first to the second, as in a flange that is drawn in, with a
  !! shear beside them so that they lie along no axes.
  real(wp), parameter :: load(3) = [1.0_wp, -0.8_wp, -0.2_wp], shear = 0.2_wp
  real(wp), parameter :: first_strain = 0.01_wp    !! of each increment that brings the flow about
  integer, parameter :: n_first = 3
  integer, parameter :: least = 2, most = 1000     !! increments that are timed
  real(wp), parameter :: enough = 0.1_wp          !! so long [s]

  !> A copy of the blank.
  type :: trial_t
    type(part_t), allocatable :: parts(:)
    type(seams_t) :: seams
  end type trial_t

contains

  !> Seconds that one evaluation of the blank's forces takes while all points flow less those while
  !! none does, with strain increments as the run has them. Zero where the law fails.
  real(wp) function flow_seconds(blank, dt, dstrain) result(seconds)
    type(blank_t), intent(in) :: blank
    real(wp), intent(in) :: dt         !! time step [time]
    real(wp), intent(in) :: dstrain    !! strain increment of a step of the run
    type(trial_t) :: trial
    real(wp) :: elastic, plastic
    logical :: ok
    integer :: i

    seconds = 0.0_wp
    trial%parts = blank%parts
    trial%seams = blank%seams
    ! To and fro, so that the strain stays elastic.
    call time_steps(trial, blank%law, dt, [dstrain, -dstrain], elastic, ok)
    if (.not. ok) return
    do i = 1, n_first
      call stretch(trial, blank%law, dt, first_strain, ok)
      if (.not. ok) return
    end do
    call time_steps(trial, blank%law, dt, [dstrain, dstrain], plastic, ok)
    if (ok) seconds = max(0.0_wp, plastic - elastic)
  end function flow_seconds

  !> Mean seconds of an increment; they take turns.
  subroutine time_steps(trial, law, dt, dstrain, seconds, ok)
    type(trial_t), intent(inout) :: trial
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, dstrain(2)
    real(wp), intent(out) :: seconds
    logical, intent(out) :: ok
    real(wp) :: start, finish
    integer :: i, n

    n = 0
    seconds = 0.0_wp
    call stretch(trial, law, dt, dstrain(1), ok)
    if (ok) call stretch(trial, law, dt, dstrain(2), ok)
    do i = 1, most
      if (.not. ok) exit
      call cpu_time(start)
      call stretch(trial, law, dt, dstrain(1 + mod(i, 2)), ok)
      call cpu_time(finish)
      seconds = seconds + finish - start
      n = n + 1
      if (n >= least .and. seconds > enough) exit
    end do
    seconds = seconds/max(n, 1)
  end subroutine time_steps

  !> Strain all of the blank alike: the speeds that do it, and forces from the new places.
  subroutine stretch(trial, law, dt, dstrain, ok)
    type(trial_t), intent(inout) :: trial
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, dstrain
    logical, intent(out) :: ok
    type(force_report_t) :: report
    integer :: p, c

    do p = 1, size(trial%parts)
      associate (motion => trial%parts(p)%element%motion)
        do c = 1, 3
          motion%v(:, :, :, c) = dstrain/dt*load(c)*motion%x(:, :, :, c)
        end do
        motion%v(:, :, :, 1) = motion%v(:, :, :, 1) + dstrain/dt*shear*motion%x(:, :, :, 2)
        motion%x = motion%x + dt*motion%v
      end associate
    end do
    call forces_of_parts(trial%parts, trial%seams, law, dt, report)
    ok = report%failed_block == huge(1)
  end subroutine stretch

end module flow_cost
