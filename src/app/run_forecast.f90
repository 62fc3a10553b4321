!> How long a run will take, from steps that are taken and timed here and now.
!!
!! Times are processor time over the number of threads: what the clock shows where nothing else
!! runs, however busy the machine is now.
!!
!! What the first steps of a run cost says little: the tools are still away. So before each of them
!! all contacts are woken, which makes it as costly as a step of forming. The blank needs no such
!! help, elastic points cost nearly what plastic ones do.
module run_forecast
  use omp_lib, only: omp_get_max_threads
  use kinds, only: wp
  use errors, only: error_t
  use contact_state, only: wake_contact
  use contact_effect, only: contact_effect_t
  use tool_mesh, only: n_mesh_points
  use model, only: model_t
  use run_data, only: run_t
  use forming_run, only: new_run, take_step
  use tool_display, only: tool_cell_length
  implicit none
  private

  public :: forecast_seconds, frame_values

  integer, parameter :: warm_up = 3              !! steps that are not timed
  integer, parameter :: least = 3, most = 2000   !! steps that are timed
  real(wp), parameter :: enough = 0.4_wp         !! so long [s]
  integer, parameter :: stride = 40              !! of the contact points that are tested
  !> Steps shorten as elements deform: 1.02 to 1.06 times the steps in the channel decks.
  real(wp), parameter :: growth = 1.03_wp
  !> Compressing and writing a value of a frame, measured on the channel decks [s].
  real(wp), parameter :: value_seconds = 1.0e-7_wp
  integer, parameter :: values_of_node = 12      !! of a display point of the blank
  integer, parameter :: values_of_tool_node = 7  !! the others are empty and cost little
  integer, parameter :: values_of_point = 7      !! of an integration point, state left out

contains

  !> Seconds that the run takes with the present threads: steps, frames and what it took to get
  !! here. A step that fails ends the measurement.
  real(wp) function forecast_seconds(model, n_steps) result(seconds)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: n_steps      !! steps at the present size
    real(wp) :: set_up
    integer :: n_rows, n_frames

    call cpu_time(set_up)
    associate (now => model%output, later => model%later_steps%output)
      n_rows = now%n_history + sum(later%n_history)
      n_frames = now%n_frames + sum(later%n_frames) + 1
    end associate
    seconds = set_up + (growth*n_steps + n_rows)*step_seconds(model) &
              + n_frames*value_seconds*frame_values(model)
  end function forecast_seconds

  !> Mean seconds of a step with all contacts awake.
  real(wp) function step_seconds(model) result(seconds)
    type(model_t), intent(inout) :: model
    type(run_t) :: run
    type(error_t), allocatable :: error
    real(wp) :: rate, dt, start, finish, spent
    integer :: i, n, n_threads

    n_threads = omp_get_max_threads()
    call new_run(model, run)
    rate = model%rate
    dt = 0.0_wp
    spent = 0.0_wp
    n = 0
    do i = 1, warm_up + most
      call wake(model)
      call cpu_time(start)
      call take_step(model, run, rate, dt, error)
      call cpu_time(finish)
      if (allocated(error) .or. run%instant%time >= model%step%end_time) exit
      if (i <= warm_up) cycle
      spent = spent + finish - start
      n = n + 1
      if (n >= least .and. spent > enough*n_threads) exit
    end do
    seconds = spent/(max(n, 1)*n_threads)
  end function step_seconds

  subroutine wake(model)
    type(model_t), intent(inout) :: model
    integer :: i

    do i = 1, size(model%forces)
      select type (item => model%forces(i)%item)
      type is (contact_effect_t)
        call wake_contact(item%pair, stride)
      end select
    end do
  end subroutine wake

  !> Numbers in a frame of the results.
  real(wp) function frame_values(model) result(n)
    type(model_t), intent(in) :: model
    real(wp) :: length
    integer :: p, t, s

    n = 0.0_wp
    do p = 1, size(model%bodies%blank%parts)
      associate (axes => model%bodies%blank%parts(p)%patch%axes)
        n = n + values_of_node*product(real(maxval(axes%degree)*axes%n_elements + 1, wp)) &
            + (values_of_point + model%bodies%blank%law%n_state)*real(product(axes%n_points), wp) &
            *product(axes%n_elements)
      end associate
    end do
    length = tool_cell_length(model)
    do t = 1, size(model%bodies%tools)
      associate (surfaces => model%bodies%tools(t)%surfaces)
        do s = 1, size(surfaces)
          n = n + real(values_of_tool_node, wp) &
              *n_mesh_points(surfaces(s), model%output%is_bezier, length)
        end do
      end associate
    end do
  end function frame_values

end module run_forecast
