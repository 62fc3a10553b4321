!> What the tests of the solver share: whole runs of small models, and laws that fail.
module solver_cases
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds, only: wp
  use failure, only: error_t, fail
  use scene, only: material_test_spec_t
  use block_law, only: block_law_t
  use result_table, only: result_table_t
  use child_process, only: shared_rows_t, free_rows, failure_of, warning_of
  use material_test, only: new_test_rows, fill_rows, fill_table
  use elastic, only: elastic_t
  use model, only: model_t
  use frames, only: results_t, results_setup_t, open_results, close_results
  use run_log, only: run_log_t, timings_t, open_log, close_log
  use run_state, only: run_t
  use run_saver, only: saver_t
  use history_columns, only: first_history_sample
  use forming_run, only: new_run, run_model
  implicit none
  private

  public :: begin_run, run_to_end, watch_names, read_points, run_test

  !> Elastic until the shear strain 12 of a step exceeds a limit; then it returns no numbers, or
  !! says that it failed.
  type, extends(elastic_t), public :: brittle_t
    real(wp) :: limit = 0.0_wp
    logical :: is_silent = .false.   !! no numbers without a word
  contains
    procedure :: update
  end type brittle_t

contains

  !> Stress and state of all points of a model's first part.
  subroutine read_points(model, stress, state)
    type(model_t), intent(in) :: model
    real(wp), allocatable, dimension(:, :, :, :, :, :, :), intent(out) :: stress, state
    real(wp), allocatable :: eqps(:, :, :, :, :, :)
    integer :: q(3), n(3)

    associate (element => model%bodies%blank%parts(1)%element)
      q = element%rule%n
      n = element%n_elements
      allocate (stress(6, q(1), q(2), q(3), n(1), n(2), n(3)))
      allocate (state(model%bodies%blank%law%n_state, q(1), q(2), q(3), n(1), n(2), n(3)))
      allocate (eqps(q(1), q(2), q(3), n(1), n(2), n(3)))
      call element%read_points(0, eqps, stress, state)
    end associate
  end subroutine read_points

  !> Run a model to its end time with results in NAME.h5 and NAME.log.
  subroutine run_to_end(model, name, run, error)
    type(model_t), intent(inout) :: model
    character(*), intent(in) :: name
    type(run_t), intent(out) :: run
    type(error_t), allocatable, intent(out) :: error
    type(results_t) :: results
    type(run_log_t) :: log
    type(saver_t) :: saver
    type(timings_t) :: timings
    type(error_t), allocatable :: file_error

    call begin_run(model, name, run, results)
    call open_log(log, name//".log", .true., file_error)
    call run_model(model, run, results, log, saver, error)
    timings%timer = model%timer
    call close_results(results, "completed", timings, file_error)
    call close_log(log)
  end subroutine run_to_end

  !> Set a run up whose results go to NAME.h5.
  subroutine begin_run(model, name, run, results)
    type(model_t), intent(inout) :: model
    character(*), intent(in) :: name
    type(run_t), intent(out) :: run
    type(results_t), intent(out) :: results
    type(results_setup_t) :: setup
    type(error_t), allocatable :: file_error
    integer :: i

    setup%path = name//".h5"
    allocate (setup%patches(size(model%bodies%blank%parts)))
    do i = 1, size(setup%patches)
      setup%patches(i)%name = model%bodies%blank%parts(i)%element%name
      setup%patches(i)%solid = model%bodies%blank%parts(i)%element%grid
      setup%patches(i)%rule = model%bodies%blank%parts(i)%element%rule
    end do
    allocate (setup%tools(size(model%bodies%tools)))
    do i = 1, size(setup%tools)
      setup%tools(i)%name = model%bodies%tools(i)%name
      setup%tools(i)%surfaces = model%bodies%tools(i)%surfaces
    end do
    setup%history = first_history_sample(model)
    setup%n_state = model%bodies%blank%law%n_state
    call new_run(model, run)
    call open_results(results, setup, file_error)
    if (allocated(file_error)) error stop "the results of the test cannot be written"
  end subroutine begin_run

  !> Carry out a test. Fails where the point cannot be taken further; the table then ends there.
  !! Warns of shear that is too large for the law.
  subroutine run_test(spec, law, table, error, warning)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(result_table_t), intent(out) :: table
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable, intent(out), optional :: warning   !! empty: none
    type(shared_rows_t) :: rows

    call new_test_rows(spec, law, rows, error)
    if (allocated(error)) return
    call fill_rows(spec, law, rows)
    if (failure_of(rows) /= "") call fail(error, failure_of(rows))
    if (present(warning)) warning = warning_of(rows)
    call fill_table(spec, law, rows, table)
    call free_rows(rows)
  end subroutine run_test

  !> Names of the stopwatches of a model, with blanks between.
  function watch_names(model) result(names)
    type(model_t), intent(in) :: model
    character(:), allocatable :: names
    integer :: i

    names = ""
    do i = 1, size(model%timer%watches)
      if (i > 1) names = names//" "
      names = names//model%timer%watches(i)%name
    end do
  end function watch_names

  !> Elastic, or a failure.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(brittle_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)

    call self%elastic_t%update(n, dt, dstrain, stress, state, ok, spin)
    if (maxval(abs(dstrain(:, 4))) <= self%limit) return
    if (self%is_silent) then
      stress = ieee_value(1.0_wp, ieee_quiet_nan)
    else
      ok = .false.
    end if
  end subroutine update

end module solver_cases
