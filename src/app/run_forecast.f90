!> What processor time a run will take, from steps that are taken and timed here and now.
!!
!! Times are processor time while one thread works: threads that wait for each other on a busy
!! machine would count as work.
!!
!! What the first steps of a run cost says little: the tools are still away, and nothing flows. So
!! before each of them all contacts are woken, which makes it as costly as a step of forming; and
!! what the flow of the blank's points adds is measured by itself, with the model's own kernels and
!! law on a copy of the blank that is stretched until all of its points flow.
!!
!! How far steps fall and how much of the blank flows, a run with fewer elements shows: see
!! `trial_run`.
module run_forecast
  use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_set_num_threads
  use kinds, only: wp
  use failure, only: error_t
  use text, only: string_t, rounded_text, append_text, counted
  use contact, only: schedule_tests
  use contact_effect, only: contact_view_t, contact_pairs
  use tool_mesh, only: n_mesh_points
  use model, only: model_t
  use run_state, only: run_t
  use forming_run, only: new_run, take_step
  use surface_grid, only: element_size_of, no_length
  use patch_seams, only: seams_t
  use block_law, only: block_law_t
  use element, only: part_t, force_report_t
  use body_parts, only: forces_of_parts
  use blank, only: blank_t
  implicit none
  private

  public :: forecast_t, outlook_t, step_cost_t, new_forecast, step_cost, forecast_lines
  public :: frame_values
  public :: tool_cell_length, flow_seconds

  !> Strains of the stretch: from the first to the second, as in a flange that is drawn in, with a
  !! shear together with them so that they lie along no axes.
  real(wp), parameter :: load(3) = [1.0_wp, -0.8_wp, -0.2_wp], shear = 0.2_wp
  real(wp), parameter :: first_strain = 0.01_wp    !! of each increment that brings the flow about
  integer, parameter :: n_first = 3
  integer, parameter :: least_flow = 2, most_flow = 1000   !! increments that are timed
  real(wp), parameter :: enough_flow = 0.1_wp              !! so long [s]

  !> A sheet between tools does not strain evenly. Its points stop to flow and flow again, some of
  !! them slowly, and laws then take more corrections. So the strains have waves along the axes that
  !! travel. Blanks of a square box take as long per step with the laws of docs/studies.md.
  real(wp), parameter :: unevenness = 4.0_wp, drift = 0.1_wp   !! drift: phase of an increment
  real(wp), parameter :: n_waves(3) = [3.0_wp, 2.0_wp, 0.5_wp]   !! in the length of a patch
  real(wp), parameter :: two_pi = 2.0_wp*acos(-1.0_wp)

  !> A copy of the blank.
  type :: trial_t
    type(part_t), allocatable :: parts(:)
    type(seams_t) :: seams
  end type trial_t

  integer, parameter :: warm_up = 3              !! steps that are not timed
  !> Of the contact points that are tested. A run tests 1 to 14 % of them in the mean, which its log
  !! reports: 2 % in the channel, 5 to 6 % in the U-bend, 4 to 14 % in a box and a cup.
  integer, parameter :: stride = 12
  integer, parameter :: least = 3, most = 150    !! steps that are timed; in more points would flow
  real(wp), parameter :: enough = 0.3_wp         !! so long [s]
  real(wp), parameter :: strain_of_run = 0.3_wp  !! that a point goes through, in equal steps
  !> Compressing and writing a value of a frame, measured on the channel decks [s].
  real(wp), parameter :: value_seconds = 5.0e-8_wp
  real(wp), parameter :: fewest_steps = 300.0_wp !! a run of fewer counts as one of so many
  integer, parameter :: values_of_node = 12      !! of a display point of the blank
  integer, parameter :: values_of_stress = 6     !! more, if the deck asks for the tensor
  integer, parameter :: values_of_resultants = 6 !! or for those of a shell
  integer, parameter :: n_layers = 3             !! as many in a point of a mid-surface
  integer, parameter :: values_of_tool_node = 7  !! the others are empty and cost little
  integer, parameter :: values_of_point = 7      !! of an integration point, without state

  !> What the first steps of a run do not show; as a trial run has found it, if there was one.
  type :: outlook_t
    !> Steps over those of the first size. They shorten as elements deform: 1.01 to 1.08 in the
    !! channels, cups and domes of docs/studies.md, but 1.26 in a box of few elements.
    real(wp) :: growth = 1.05_wp
    !> Fraction of the rows of points that flow at a time, the mean of a run. One point that flows
    !! makes its row cost as much as all do, so it is more than the fraction of the points.
    real(wp) :: flowing = 0.75_wp
    real(wp) :: ratio = 1.0_wp       !! of the mean step to what `step_cost` foretells for it
    real(wp) :: set_up = 0.0_wp      !! before the first step [s]
    logical :: is_tried = .false.    !! these are what a trial run shows
  end type outlook_t

  !> Processor time of one step [s].
  type :: step_cost_t
    real(wp) :: elastic = 0.0_wp     !! while nothing flows
    real(wp) :: flow = 0.0_wp        !! added where all points flow
  end type step_cost_t

  !> What a run will take.
  type :: forecast_t
    real(wp) :: step = 0.0_wp        !! seconds of a step while nothing flows [s]
    real(wp) :: seconds = 0.0_wp     !! processor time of the run [s]
    real(wp) :: at_least = 0.0_wp    !! if no point flows
    real(wp) :: at_most = 0.0_wp     !! if all do all the time
    integer :: n_threads = 1         !! that divide the work
  end type forecast_t

contains

  !> Processor time that the run takes: steps, frames and what it took to get here. A step that
  !! fails ends the measurement.
  function new_forecast(model, n_steps, outlook) result(forecast)
    type(model_t), intent(inout) :: model   !! some steps of it are taken
    real(wp), intent(in) :: n_steps         !! steps at the present size
    type(outlook_t), intent(in) :: outlook
    type(forecast_t) :: forecast
    type(step_cost_t) :: cost
    real(wp) :: n_calls, flow, rest
    integer :: n_frames

    associate (now => model%output, later => model%later_steps%output)
      n_calls = outlook%growth*n_steps + now%n_history + sum(later%n_history)
      n_frames = now%n_frames + sum(later%n_frames) + 1
    end associate
    cost = step_cost(model, n_steps)
    forecast%step = outlook%ratio*cost%elastic
    flow = n_calls*outlook%ratio*cost%flow
    rest = outlook%set_up + n_calls*forecast%step &
           + n_frames*value_seconds*frame_values(model)
    forecast%seconds = rest + outlook%flowing*flow
    forecast%at_least = merge(forecast%seconds, rest, outlook%is_tried)
    forecast%at_most = merge(forecast%seconds, rest + flow, outlook%is_tried)
    if (.not. model%bodies%blank%law%is_serial) &
      forecast%n_threads = min(omp_get_max_threads(), omp_get_num_procs())
  end function new_forecast

  !> What a step takes in the mean over a run of so many, measured with one thread.
  function step_cost(model, n_steps) result(cost)
    type(model_t), intent(inout) :: model   !! some steps of it are taken
    real(wp), intent(in) :: n_steps
    type(step_cost_t) :: cost
    integer :: n_threads

    n_threads = omp_get_max_threads()
    call omp_set_num_threads(1)
    ! The flow first: it needs a blank of which no point has flowed yet.
    cost%flow = flow_seconds(model%bodies%blank, model%stable_step, &
                             strain_of_run/max(n_steps, fewest_steps), &
                             size(contact_pairs(model%forces)) > 0)
    cost%elastic = step_seconds(model)
    call omp_set_num_threads(n_threads)
  end function step_cost

  !> The forecast, for standard output; where the flow of the points decides, what it would be
  !! without and with all of them.
  function forecast_lines(forecast) result(lines)
    type(forecast_t), intent(in) :: forecast
    type(string_t), allocatable :: lines(:)
    real(wp), parameter :: telling = 1.3_wp

    allocate (lines(0))
    call append_text(lines, "run time         about "//rounded_text(forecast%seconds)// &
                            " s of processor time, "// &
                            rounded_text(forecast%seconds/forecast%n_threads)//" s on "// &
                            counted(forecast%n_threads, "idle core"))
    if (forecast%at_most > telling*forecast%at_least) &
      call append_text(lines, "                 "//rounded_text(forecast%at_least)// &
                              " s if no point flows, "//rounded_text(forecast%at_most)// &
                              " s if all do all the time")
  end function forecast_lines

  !> Mean seconds of a step with all contacts awake.
  real(wp) function step_seconds(model) result(seconds)
    type(model_t), intent(inout) :: model
    type(run_t) :: run
    type(error_t), allocatable :: error
    real(wp) :: rate, dt, start, finish, spent
    integer :: i, n

    call new_run(model, run)
    rate = model%rate
    dt = 0.0_wp
    spent = 0.0_wp
    n = 0
    do i = 1, warm_up + most
      if (i > 1) call wake(model)   ! the first one searches all points
      call cpu_time(start)
      call take_step(model, run, rate, dt, error)
      call cpu_time(finish)
      if (allocated(error) .or. run%instant%time >= model%step%duration) exit
      if (i <= warm_up) cycle
      spent = spent + finish - start
      n = n + 1
      if (n >= least .and. spent > enough) exit
    end do
    seconds = spent/max(n, 1)
  end function step_seconds

  subroutine wake(model)
    type(model_t), intent(inout), target :: model
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(model%forces)
    do i = 1, size(pairs)
      call schedule_tests(pairs(i)%pair%pair, stride)
    end do
  end subroutine wake

  !> Numbers in a frame of the results.
  real(wp) function frame_values(model) result(n)
    type(model_t), intent(in) :: model
    real(wp) :: length
    integer :: p, t, s, n_node, n_axes

    n_node = values_of_node + merge(values_of_stress, 0, model%output%has_stress)
    n_axes = 3
    if (model%output%is_surface) then
      n_node = n_layers*n_node
      n_axes = 2
    end if
    n_node = n_node + merge(values_of_resultants, 0, model%output%has_resultants)
    n = 0.0_wp
    do p = 1, size(model%bodies%blank%parts)
      associate (element => model%bodies%blank%parts(p)%element)
        n = n + n_node*product(real(maxval(element%grid%axes%degree) &
                                    *element%n_elements(:n_axes) + 1, wp)) &
            + (values_of_point + model%bodies%blank%law%n_state) &
            *real(product(element%rule%n), wp)*product(element%n_elements)
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

  !> Longest cell of a tool [length]: with contact pressure as long as the elements of the blank's
  !! first patch are on average, else without limit.
  real(wp) function tool_cell_length(model) result(length)
    type(model_t), intent(in) :: model

    length = no_length
    if (model%output%has_pressure) then
      length = element_size_of(model%bodies%blank%parts(1)%element%surface(6))
    end if
  end function tool_cell_length

  !> Seconds that one evaluation of the blank's forces takes while all points flow less those while
  !! none does, with strain increments as the run has them. Zero where the law fails.
  real(wp) function flow_seconds(blank, dt, dstrain, is_pressed) result(seconds)
    type(blank_t), intent(in) :: blank
    real(wp), intent(in) :: dt         !! time step [time]
    real(wp), intent(in) :: dstrain    !! strain increment of a step of the run
    logical, intent(in) :: is_pressed  !! by tools, so that it does not strain evenly
    type(trial_t) :: trial
    real(wp) :: elastic, plastic
    logical :: ok
    integer :: i

    seconds = 0.0_wp
    trial%parts = blank%parts
    trial%seams = blank%seams
    ! To and fro, so that the strain stays elastic.
    call time_steps(trial, blank%law, dt, [dstrain, -dstrain], 0.0_wp, elastic, ok)
    if (.not. ok) return
    do i = 1, n_first
      call stretch(trial, blank%law, dt, first_strain, [0.0_wp, 0.0_wp], ok)
      if (.not. ok) return
    end do
    call time_steps(trial, blank%law, dt, [dstrain, dstrain], &
                    merge(unevenness, 0.0_wp, is_pressed), plastic, ok)
    if (ok) seconds = max(0.0_wp, plastic - elastic)
  end function flow_seconds

  !> Mean seconds of an increment; both are alternated.
  subroutine time_steps(trial, law, dt, dstrain, uneven, seconds, ok)
    type(trial_t), intent(inout) :: trial
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, dstrain(2)
    real(wp), intent(in) :: uneven       !! amplitude of the strain's waves over its mean
    real(wp), intent(out) :: seconds
    logical, intent(out) :: ok
    real(wp) :: start, finish
    integer :: i, n

    n = 0
    seconds = 0.0_wp
    call stretch(trial, law, dt, dstrain(1), [uneven, 0.0_wp], ok)
    if (ok) call stretch(trial, law, dt, dstrain(2), [uneven, drift], ok)
    do i = 1, most_flow
      if (.not. ok) exit
      call cpu_time(start)
      call stretch(trial, law, dt, dstrain(1 + mod(i, 2)), [uneven, (i + 1)*drift], ok)
      call cpu_time(finish)
      seconds = seconds + finish - start
      n = n + 1
      if (n >= least_flow .and. seconds > enough_flow) exit
    end do
    seconds = seconds/max(n, 1)
  end subroutine time_steps

  !> Strain the blank: the speeds that do it, and forces from the new positions.
  subroutine stretch(trial, law, dt, dstrain, wave, ok)
    type(trial_t), intent(inout) :: trial
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, dstrain
    real(wp), intent(in) :: wave(2)      !! of the strain along the axes: amplitude, phase
    logical, intent(out) :: ok
    type(force_report_t) :: report
    real(wp) :: number
    integer :: p, c

    do p = 1, size(trial%parts)
      associate (motion => trial%parts(p)%element%motion)
        do c = 1, 3
          associate (x => motion%x(:, :, :, c), rate => dstrain/dt*load(c))
            number = n_waves(c)*two_pi/max(maxval(x) - minval(x), tiny(1.0_wp))
            motion%v(:, :, :, c) = rate*(x + wave(1)/number*sin(number*x + wave(2)))
          end associate
        end do
        motion%v(:, :, :, 1) = motion%v(:, :, :, 1) + dstrain/dt*shear*motion%x(:, :, :, 2)
        motion%x = motion%x + dt*motion%v
      end associate
    end do
    call forces_of_parts(trial%parts, trial%seams, law, dt, report)
    ok = report%failed_block == huge(1)
  end subroutine stretch

end module run_forecast
