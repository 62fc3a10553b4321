!> A run of the benchmark from the command line to the records.
module bench_run
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use omp_lib, only: omp_get_max_threads, omp_set_dynamic
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use bench_case, only: case_slot_t, sampling_t, measure_until_quiet
  use bench_record, only: record_t, keep_least, heading, record_line, &
                          unquiet_line, check_writable, write_records
  use bench_options, only: options_t, is_chosen
  use machine_bound, only: measure_machine
  use catalogue, only: all_cases
  use channel_case, only: channel_case_t, add_parts
  use vector_check, only: vector_count_t, count_vectors, vector_line, is_vectorised
  implicit none
  private

  public :: run_benchmark, list_names, check_vectors

  integer, parameter :: done = 0, bad_command = 1, bad_result = 2, skipped = 77

contains

  !> Measure what the options choose; the exit code tells how it went.
  integer function run_benchmark(options) result(code)
    type(options_t), intent(in) :: options
    type(record_t), allocatable :: records(:)
    type(sampling_t) :: plan
    type(error_t), allocatable :: error
    integer :: i, n_threads

    call omp_set_dynamic(.false.)
    code = done
    allocate (records(0))
    call check_choice(options, error)
    if (.not. allocated(error) .and. options%json /= "") call check_writable(options%json, error)
    if (allocated(error)) then
      code = say(error, bad_command)
      return
    end if
    n_threads = omp_get_max_threads()
    if (options%n_threads > 0) n_threads = options%n_threads
    if (options%is_quick) plan = sampling_t(seconds=0.1_wp, least=4)
    plan%n_rounds = options%n_rounds
    do i = 1, options%n_rounds
      if (options%n_rounds > 1) &
        print "(a)", "round "//to_text(i)//" of "//to_text(options%n_rounds)
      call measure_all(options, plan, n_threads, records, code)
    end do
    if (unquiet_line(records) /= "") print "(a)", unquiet_line(records)
    if (options%json /= "") call write_records(options%json, records, error)
    if (allocated(error)) code = say(error, bad_command)
  end function run_benchmark

  !> An error where the options choose no record but those of the machine.
  subroutine check_choice(options, error)
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(case_slot_t), allocatable :: cases(:)
    integer :: i

    if (is_chosen(options, "machine/multiply_add") .or. is_chosen(options, "machine/triad")) return
    call all_cases(options%is_quick, cases)
    do i = 1, size(cases)
      if (options%is_quick .and. cases(i)%item%is_long) cycle
      if (is_chosen(options, cases(i)%item%name)) return
    end do
    call fail(error, "the options choose no record; --list prints the names of all")
  end subroutine check_choice

  !> One round: the machine, then all that is chosen. Rounds lie minutes apart, for the host of a
  !! virtual machine may be slow while one record is measured and fast for the next.
  subroutine measure_all(options, plan, n_threads, records, code)
    type(options_t), intent(in) :: options
    type(sampling_t), intent(in) :: plan
    integer, intent(in) :: n_threads
    type(record_t), allocatable, intent(inout) :: records(:)
    integer, intent(inout) :: code
    type(case_slot_t), allocatable :: cases(:)
    integer :: i

    print "(a)", heading()
    do i = 1, n_threads
      call measure_machine(i, merge(4, 15, options%is_quick), records)
    end do
    call print_records(records, "machine")
    call all_cases(options%is_quick, cases)
    do i = 1, size(cases)
      if (.not. is_chosen(options, cases(i)%item%name)) cycle
      if (options%is_quick .and. cases(i)%item%is_long) cycle
      call measure_case(plan, n_threads, cases(i), records, code)
    end do
  end subroutine measure_all

  !> One case on 1 to all threads; what it holds is freed in the end.
  subroutine measure_case(plan, n_threads, slot, records, code)
    type(sampling_t), intent(in) :: plan
    integer, intent(in) :: n_threads
    type(case_slot_t), intent(inout) :: slot
    type(record_t), allocatable, intent(inout) :: records(:)
    integer, intent(inout) :: code
    type(record_t) :: record
    type(error_t), allocatable :: error
    integer :: threads

    call slot%item%prepare(error)
    if (allocated(error)) then
      write (error_unit, "(a)") slot%item%name//" is left out: "//error%message
      deallocate (slot%item)
      return
    end if
    do threads = 1, merge(1, n_threads, slot%item%is_serial)
      call measure_until_quiet(plan, slot%item, threads, record, error)
      if (allocated(error)) then
        code = say(error, bad_result)
        exit
      end if
      call keep_least(records, record)
      select type (item => slot%item)
      type is (channel_case_t)
        call add_parts(item, record, records)
      end select
      call print_records(records, slot%item%name, threads)
    end do
    deallocate (slot%item)
  end subroutine measure_case

  !> The records of this name, or below it, on this or any number of threads.
  subroutine print_records(records, name, threads)
    type(record_t), intent(in) :: records(:)
    character(*), intent(in) :: name
    integer, intent(in), optional :: threads
    integer :: i

    do i = 1, size(records)
      associate (record => records(i))
        if (present(threads)) then
          if (record%threads /= threads) cycle
        end if
        if (record%name == name .or. index(record%name, name//"/") == 1) &
          print "(a)", record_line(record)
      end associate
    end do
    flush (output_unit)
  end subroutine print_records

  integer function say(error, given) result(code)
    type(error_t), intent(in) :: error
    integer, intent(in) :: given

    write (error_unit, "(a)") "igaform_bench: error: "//error%message
    code = given
  end function say

  !> Print the names that the options choose.
  integer function list_names(options) result(code)
    type(options_t), intent(in) :: options
    type(case_slot_t), allocatable :: cases(:)
    integer :: i

    code = done
    call all_cases(options%is_quick, cases)
    do i = 1, size(cases)
      if (options%is_quick .and. cases(i)%item%is_long) cycle
      if (is_chosen(options, cases(i)%item%name)) print "(a)", cases(i)%item%name
    end do
  end function list_names

  !> Print how much of the hot procedures is vectorised; a scalar one is a failure.
  integer function check_vectors() result(code)
    type(vector_count_t), allocatable :: counts(:)
    type(error_t), allocatable :: error
    integer :: i

    call count_vectors(counts, error)
    if (allocated(error)) then
      code = say(error, bad_result)
      return
    else if (.not. allocated(counts)) then
      print "(a)", "there is no objdump: not checked"
      code = skipped
      return
    end if
    code = done
    print "(a)", "procedure                                             wide   fused   other"
    do i = 1, size(counts)
      print "(a)", vector_line(counts(i))
      if (.not. is_vectorised(counts(i))) code = bad_result
    end do
  end function check_vectors

end module bench_run
