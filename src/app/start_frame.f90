!> What a result file has to know of a run, and the result of a deck at its start, with one frame.
module start_frame
  use failure, only: error_t
  use omp_lib, only: omp_get_max_threads
  use exit_codes, only: exit_interrupted, status_of
  use command_line, only: command_t
  use run_identity, only: provenance_of
  use output_files, only: files_read, result_path
  use scene, only: scene_t
  use model, only: model_t
  use blank, only: mass_of
  use display_fields, only: output_fields
  use frames, only: results_t, results_setup_t, open_results, close_results
  use run_log, only: timings_t
  use run_state, only: run_t
  use run_forecast, only: tool_cell_length
  use run_frames, only: add_frame, release_frames
  use forming_run, only: new_run
  use history_columns, only: first_history_sample
  implicit none
  private

  public :: fill_setup, write_start_frame

contains

  !> Write the result of a run that has not begun: the frame of the start. The model may have errors
  !! of its set-up, which this frame shows.
  subroutine write_start_frame(command, scene, model, error)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(error_t), allocatable, intent(out) :: error
    type(model_t) :: copy          ! `new_run` adds to the model
    type(results_setup_t) :: setup
    type(results_t) :: results
    type(run_t) :: run
    type(timings_t) :: timings

    copy = model
    call fill_setup(scene, copy, setup)
    call result_path(command, files_read(command, scene), setup%path, error)
    if (allocated(error)) return
    call new_run(copy, run)
    call open_results(results, setup, error)
    if (allocated(error)) return
    call add_frame(copy, run)
    call release_frames(copy, run, results, run%n_waiting, error)
    if (allocated(error)) return
    timings%timer = copy%timer
    timings%n_threads = omp_get_max_threads()
    call close_results(results, status_of(exit_interrupted), timings, error)
  end subroutine write_start_frame

  !> What the result file, but for its path, needs to know of the model and of this program.
  subroutine fill_setup(scene, model, setup)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(results_setup_t), intent(out) :: setup
    integer :: i, p

    allocate (setup%patches(size(model%bodies%blank%parts)))
    do p = 1, size(setup%patches)
      setup%patches(p)%name = model%bodies%blank%parts(p)%element%name
      setup%patches(p)%solid = model%bodies%blank%parts(p)%element%body()
      setup%patches(p)%rule = model%bodies%blank%parts(p)%element%rule
      associate (ties => model%bodies%blank%parts(p)%element%ties)
        if (allocated(ties%share)) setup%patches(p)%share = ties%share
      end associate
    end do
    allocate (setup%tools(size(scene%tools)))
    do i = 1, size(scene%tools)
      setup%tools(i)%name = scene%tools(i)%name
      setup%tools(i)%side = model%bodies%tools(i)%side
      setup%tools(i)%surfaces = model%bodies%tools(i)%surfaces
      setup%tools(i)%cell_length = tool_cell_length(model)
    end do
    setup%history = first_history_sample(model)
    if (allocated(scene%step%name)) then
      allocate (setup%steps(1 + size(scene%later_steps)))
      setup%steps(1)%value = scene%step%name
      do i = 2, size(setup%steps)
        setup%steps(i)%value = scene%later_steps(i - 1)%step%name
      end do
    end if
    setup%n_state = model%bodies%blank%law%n_state - model%bodies%blank%law%n_hidden
    associate (material => scene%materials(scene%blank%material))
      if (allocated(material%state_names)) setup%state_names = material%state_names
    end associate
    setup%is_bezier = scene%output%is_bezier
    setup%is_surface = scene%output%is_surface
    setup%fields = output_fields(count([scene%output%has_pressure, scene%output%has_wear]), &
                                 scene%output%has_stress, scene%output%has_resultants, &
                                 scene%output%is_surface, size(model%trims) > 0 .or. &
                                 any(model%bodies%tools%is_trimmed), &
                                 model%bodies%blank%law%has_damage)
    setup%width_ratio = model%width_ratio
    setup%blank_mass = model%width_ratio*mass_of(model%bodies%blank%parts) &
                       /model%bodies%blank%mass_factor
    setup%provenance = provenance_of(scene)
    setup%provenance%n_threads = omp_get_max_threads()
  end subroutine fill_setup

end module start_frame
