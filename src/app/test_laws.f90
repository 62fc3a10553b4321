!> The laws of the tests of one material point.
module test_laws
  use kinds, only: wp
  use failure, only: error_t, fail
  use input_errors, only: error_list_t, add_error
  use text, only: to_text, counted
  use scene, only: scene_t, material_spec_t, material_test_spec_t
  use block_law, only: block_law_t
  use user_library, only: user_library_t
  use law_setup, only: build_law, refuse_call
  use user_law, only: lacks_moduli, find_moduli, first_point_t
  use material_point, only: material_point_t, new_point
  use material_test, only: test_problem
  use child_process, only: shared_rows_t, new_rows, free_rows, begin_rows, add_row, end_rows, &
                           is_ended, failure_of, values_of, end_process
  use exit_codes, only: exit_files
  use test_process, only: begin_copy, wait_for_end, end_words
  implicit none
  private

  public :: law_slot_t, make_laws

  !> The law of a test.
  type :: law_slot_t
    class(block_law_t), allocatable :: law
    character(:), allocatable :: failure   !! why the law cannot be called; not allocated: it can
    logical :: is_refused = .false.        !! for want of memory
  end type law_slot_t

contains

  !> The law of each test, with its constants checked. Tests lie in the axes of the material, so
  !! its *ORIENTATION, which says how it lies in a blank, does not matter here.
  subroutine make_laws(scene, slots, errors, library)
    type(scene_t), intent(in) :: scene
    type(law_slot_t), allocatable, intent(out) :: slots(:)
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library   !! for *USER MATERIAL
    real(wp), parameter :: aligned(6) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp]
    type(material_spec_t) :: material
    character(:), allocatable :: reason
    integer :: i, first

    allocate (slots(size(scene%tests)))
    do i = 1, size(scene%tests)
      associate (test => scene%tests(i))
        first = findloc(scene%tests%material == test%material .and. &
                        (scene%tests%is_plane .eqv. test%is_plane), .true., 1)
        if (first == i) then
          material = scene%materials(test%material)
          material%is_sheet = test%is_plane
          if (material%plasticity%potential /= "") material%plasticity%orientation = aligned
          call build_law(material, slots(i)%law, errors, library, n_given(test))
          if (allocated(slots(i)%law)) call ask_law(test, material, slots(i), errors)
        else
          slots(i) = slots(first)
        end if
        if (.not. allocated(slots(i)%law)) cycle
        reason = test_problem(test, slots(i)%law)
        if (reason /= "") call add_error(errors, test%origin, reason, "a law with plasticity")
        associate (n => slots(i)%law%n_state - slots(i)%law%n_hidden - &
                       scene%materials(test%material)%n_uvarm)
          if (findloc(scene%tests%material, test%material, 1) == i .and. size(test%state) > n) &
            call add_error(errors, test%state_origin, counted(size(test%state), &
                           "state variable")//" for ALL", to_text(n)//" at most, as material "// &
                           scene%materials(test%material)%name//" has")
        end associate
      end associate
    end do
  end subroutine make_laws

  !> Temperature and field variables that a test gives.
  pure integer function n_given(test)
    type(material_test_spec_t), intent(in) :: test

    n_given = 0
    if (allocated(test%fields)) n_given = size(test%fields)
  end function n_given

  !> Let a user's law without elastic moduli in the deck report them, at the start of a test. The
  !! call is made in a copy of this process: where it ends the program, only this law has failed.
  subroutine ask_law(test, material, slot, errors)
    type(material_test_spec_t), intent(in) :: test
    type(material_spec_t), intent(in) :: material
    type(law_slot_t), intent(inout) :: slot         !! its law is freed where it has no moduli
    type(error_list_t), intent(inout) :: errors
    type(shared_rows_t) :: answer
    type(error_t), allocatable :: error
    real(wp) :: moduli(2, 1)
    integer :: process, code

    if (.not. lacks_moduli(slot%law)) return
    slot%is_refused = .not. new_rows(answer, 2, 1)
    if (slot%is_refused) then
      slot%failure = "out of memory for its first call"
      return
    end if
    process = begin_copy()
    if (process <= 0) call answer_for(test, slot%law, answer)
    if (process == 0) call end_process()
    if (process > 0) call wait_for_end(process, code)
    if (.not. is_ended(answer)) then
      slot%failure = end_words(code)//" before its first increment, when asked for the stiffness"
      slot%is_refused = code == exit_files
    else if (failure_of(answer) /= "") then
      call fail(error, failure_of(answer))
      call refuse_call(material, error, errors)
      deallocate (slot%law)
    else
      moduli = values_of(answer)
      slot%law%bulk = moduli(1, 1)
      slot%law%shear = moduli(2, 1)
    end if
    call free_rows(answer)
  end subroutine ask_law

  !> Bulk and shear modulus of a law as a row, or why it has none.
  subroutine answer_for(test, law, answer)
    type(material_test_spec_t), intent(in) :: test
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(inout) :: answer
    real(wp), parameter :: short = 1.0e-9_wp                ! time of the call
    type(first_point_t) :: first
    type(material_point_t) :: point
    type(error_t), allocatable :: error
    real(wp) :: bulk, shear

    call begin_rows(answer)
    point = new_point(law, test%state, test%fields, test%is_plane)
    first%n_fields = size(test%fields)
    first%fields(:first%n_fields) = test%fields
    call find_moduli(law, short, first, point%state, bulk, shear, error)
    if (.not. allocated(error)) call add_row(answer, [bulk, shear])
    if (.not. allocated(error)) allocate (error, source=error_t(""))
    call end_rows(answer, error%message, "")
  end subroutine answer_for

end module test_laws
