!> The channel example: all of its steps, and its motion update, history rows and frames alone.
module channel_case
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: strings
  use input_errors, only: error_list_t, n_errors
  use timer, only: watch_seconds, clock_ticks, ticks_to_seconds
  use scene, only: scene_t
  use deck_reader, only: read_deck
  use blank, only: n_controls_of
  use model, only: model_t
  use model_setup, only: build_model
  use frames, only: results_t, results_setup_t, open_results, write_frame, close_results
  use run_log, only: run_log_t, timings_t, open_log, close_log
  use run_frames, only: fill_frame
  use history_columns, only: first_history_sample
  use solid_forces, only: add_tiles
  use solid_element, only: solid_element_t
  use central_difference, only: advance
  use run_state, only: run_t
  use energy_balance, only: energy_balance_t
  use run_saver, only: saver_t
  use forming_run, only: new_run, run_model, take_balances, add_sample
  use bench_case, only: bench_case_t
  use bench_record, only: record_t, keep_least
  use system_files, only: make_folder, remove_file
  use bench_paths, only: project_folder, scratch_folder
  implicit none
  private

  public :: add_parts

  !> The channel with parameters of its own; which part of the work is run is told by `part`.
  type, extends(bench_case_t), public :: channel_case_t
    character(12) :: part = "step"             !! step, update, scatter, history or frame
    character(16) :: closing = "closing=150"   !! how far the dies close
    type(scene_t) :: scene
    type(model_t) :: model
    type(run_t) :: solver
    type(results_t) :: results
    character(:), allocatable :: file          !! result file, removed in the end
    logical :: is_open = .false.
    integer :: n_calls = 1
    real(wp), allocatable :: seconds(:)        !! of the stopwatches in the quickest run
    real(wp) :: least = huge(1.0_wp)           !! seconds of that run
    logical :: has_failed = .false.
  contains
    procedure :: prepare
    procedure :: run
    procedure :: restore
    procedure :: check
  end type channel_case_t

contains

  !> Read the deck and build the model once, so that errors show here.
  subroutine prepare(self, error)
    class(channel_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(error_list_t) :: errors
    real(wp) :: n_controls

    call make_folder(scratch_folder)
    call read_deck(project_folder()//"/input/channel_forming.key", &
                   strings([character(16) :: self%closing, "frames=1", "history=20"]), &
                   self%scene, errors)
    if (n_errors(errors) > 0) then
      call fail(error, self%name//": input/channel_forming.key cannot be read")
      return
    end if
    self%file = scratch_folder//"/bench_"//trim(self%part)//".h5"
    call new_model(self, error)
    if (allocated(error)) return
    ! What one call of `run` works through; that of whole steps shows when they are done.
    n_controls = n_controls_of(self%model%bodies%blank%parts)
    select case (trim(self%part))
    case ("update")
      self%n_calls = 200
      self%n_units = self%n_calls*n_controls
      ! Velocities and positions read and written, velocities read once more; two forces and mass.
      self%bytes = 8.0_wp*(6 + 6 + 3 + 6 + 1)
      self%flops = 18.0_wp
      self%working_set = 8.0_wp*13*n_controls
    case ("scatter")
      self%n_calls = 200
      self%n_units = self%n_calls*n_controls
    case ("history")
      self%n_calls = 50
      self%n_units = self%n_calls
    case ("frame")
      self%n_units = 1.0_wp
    end select
  end subroutine prepare

  !> A model at rest with an open result file.
  subroutine new_model(self, error)
    class(channel_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(error_list_t) :: errors
    type(results_setup_t) :: setup
    integer :: i

    call close_model(self)
    call build_model(self%scene, self%model, errors)
    if (n_errors(errors) > 0) then
      call fail(error, self%name//": the channel cannot be built")
      return
    end if
    call new_run(self%model, self%solver)
    setup%path = self%file
    allocate (setup%patches(1))
    setup%patches(1)%name = self%model%bodies%blank%parts(1)%element%name
    setup%patches(1)%solid = self%model%bodies%blank%parts(1)%element%grid
    setup%patches(1)%rule = self%model%bodies%blank%parts(1)%element%rule
    allocate (setup%tools(size(self%scene%tools)))
    do i = 1, size(setup%tools)
      setup%tools(i)%name = self%scene%tools(i)%name
      setup%tools(i)%surfaces = self%scene%tools(i)%surfaces
    end do
    setup%history = first_history_sample(self%model)
    setup%n_state = self%model%bodies%blank%law%n_state
    call open_results(self%results, setup, error)
    self%is_open = .not. allocated(error)
  end subroutine new_model

  subroutine close_model(self)
    class(channel_case_t), intent(inout) :: self
    type(timings_t) :: timings
    type(error_t), allocatable :: ignored

    if (.not. self%is_open) return
    timings%timer = self%model%timer
    call close_results(self%results, "completed", timings, ignored)
    call remove_file(self%file)
    self%is_open = .false.
  end subroutine close_model

  !> Whole runs start anew.
  subroutine restore(self)
    class(channel_case_t), intent(inout) :: self
    type(error_t), allocatable :: error

    if (self%part /= "step") return
    call new_model(self, error)
    self%has_failed = self%has_failed .or. allocated(error)
  end subroutine restore

  subroutine run(self)
    class(channel_case_t), intent(inout) :: self
    type(energy_balance_t) :: balance
    type(error_t), allocatable :: error
    integer :: i

    if (self%has_failed) return
    select case (trim(self%part))
    case ("step")
      call run_steps(self)
    case ("update")
      ! The motion of a step without forces: a blank at rest stays at rest.
      associate (body => self%model%bodies%blank%parts(1)%element)
        do i = 1, self%n_calls
          call advance(shape(body%inertia), 1.0e-7_wp, 1.0e-7_wp, body%inertia, .true., &
                       body%motion%external_force, body%motion%internal_force, body%motion%v, &
                       body%motion%x)
        end do
      end associate
    case ("scatter")
      select type (body => self%model%bodies%blank%parts(1)%element)
      type is (solid_element_t)
        do i = 1, self%n_calls
          !$omp parallel
          call add_tiles(body%patch, body%buffers, body%motion%internal_force)
          !$omp end parallel
        end do
      end select
    case ("history")
      do i = 1, self%n_calls
        call take_balances(self%model, self%solver, balance)
        call add_sample(self%model, self%solver, self%results)
      end do
    case ("frame")
      call fill_frame(self%model, self%solver%instant%time, self%solver%frames(1))
      call write_frame(self%results, self%solver%frames(1), error)
      self%has_failed = allocated(error)
    end select
  end subroutine run

  subroutine run_steps(self)
    class(channel_case_t), intent(inout) :: self
    type(error_t), allocatable :: error
    type(run_log_t) :: log
    type(saver_t) :: saver
    integer(int64) :: started
    real(wp) :: seconds
    integer :: i

    call open_log(log, scratch_folder//"/bench.log", .true., error)
    started = clock_ticks()
    call run_model(self%model, self%solver, self%results, log, saver, error)
    seconds = ticks_to_seconds(clock_ticks() - started)
    call close_log(log)
    self%has_failed = self%has_failed .or. allocated(error)
    associate (element => self%model%bodies%blank%parts(1)%element)
      self%n_units = real(self%solver%n_steps, wp)*product(element%n_elements)
      self%n_points = product(element%rule%n)
    end associate
    if (seconds >= self%least) return
    self%least = seconds
    self%seconds = [(watch_seconds(self%model%timer, i), i=1, size(self%model%timer%watches))]
  end subroutine run_steps

  subroutine check(self, error)
    class(channel_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (self%has_failed) call fail(error, self%name//": the run failed")
  end subroutine check

  !> After whole runs: a record for each effect that took time in the quickest of them. The case
  !! is done with.
  subroutine add_parts(self, whole, records)
    class(channel_case_t), intent(inout) :: self
    type(record_t), intent(in) :: whole
    type(record_t), allocatable, intent(inout) :: records(:)
    type(record_t) :: record
    integer :: i

    if (allocated(self%seconds)) then
      do i = 1, size(self%seconds)
        if (.not. self%seconds(i) > 0.0_wp) cycle
        record = whole
        record%name = whole%name//"/"//in_one_word(self%model%timer%watches(i)%name)
        record%ns = 1.0e9_wp*self%seconds(i)/self%n_units
        record%median = record%ns
        record%ns_per_point = -1.0_wp
        call keep_least(records, record)
      end do
    end if
    self%least = huge(1.0_wp)
    call close_model(self)
  end subroutine add_parts

  pure function in_one_word(given) result(word)
    character(*), intent(in) :: given
    character(len(given)) :: word
    integer :: i

    word = given
    do i = 1, len(given)
      if (given(i:i) == " ") word(i:i) = "_"
    end do
  end function in_one_word

end module channel_case
