!> The law of a material: one of the table, or a user's.
module law_setup
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: upper_case
  use scene, only: material_spec_t, is_user_material
  use block_law, only: block_law_t
  use material_table, only: new_law
  use user_library, only: user_library_t
  use user_law, only: new_user_law
  implicit none
  private

  public :: build_law

contains

  !> The law with its constants checked; not allocated where an error was added.
  subroutine build_law(material, law, errors, library, n_fields)
    type(material_spec_t), intent(in) :: material
    class(block_law_t), allocatable, intent(out) :: law
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library   !! subroutines of the user
    integer, intent(in), optional :: n_fields   !! temperature and field variables of the deck
    type(error_t), allocatable :: error
    character(:), allocatable :: note
    integer :: i, n_own

    if (.not. is_user_material(material)) then
      call new_law(material%law_spec_t, law, error)
      if (allocated(error)) call add_error(errors, material%origin, error%message, &
                                           "constants that the law accepts")
      return
    end if
    if (.not. present(library)) then
      call add_error(errors, material%origin, "*USER MATERIAL without a subroutine", &
                     "--user FILE with the UMAT or VUMAT on the command line")
      return
    end if
    n_own = 0
    if (present(n_fields)) n_own = max(0, n_fields - 1)
    call new_user_law(library, material, n_own, law, note, error)
    if (allocated(error)) then
      call add_error(errors, material%origin, error%message, "a law that can be called")
      return
    end if
    if (note /= "") call add_warning(errors, material%origin, note, &
                                     "none of these, or THREADSAFE=YES where they do no harm")
    if (.not. allocated(material%state_names)) return
    do i = 1, size(material%state_names)
      if (any(upper_case(material%state_names(i)%value) == ["EQPS", "PEEQ"])) law%eqps_state = i
    end do
  end subroutine build_law

end module law_setup
