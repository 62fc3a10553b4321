!> The law of a material: one of the table, or a user's.
module law_setup
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: upper_case
  use scene, only: material_spec_t, is_user_material
  use block_law, only: block_law_t
  use law_spec, only: law_spec_t
  use material_table, only: new_law
  use user_library, only: user_library_t
  use user_law, only: user_material_t, new_user_law
  implicit none
  private

  public :: build_law

contains

  !> The law with its constants checked; not allocated where an error was added.
  subroutine build_law(material, law, errors, library)
    type(material_spec_t), intent(in) :: material
    class(block_law_t), allocatable, intent(out) :: law
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library   !! subroutines of the user
    type(error_t), allocatable :: error

    if (is_user_material(material)) then
      call build_user_law(material, law, errors, library)
    else
      call new_material_law(material, law, error)
      if (allocated(error)) call add_error(errors, material%origin, error%message, &
                                           "constants that the law accepts")
    end if
  end subroutine build_law

  subroutine build_user_law(material, law, errors, library)
    type(material_spec_t), intent(in) :: material
    class(block_law_t), allocatable, intent(out) :: law
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library
    type(user_material_t) :: user
    type(error_t), allocatable :: error
    character(:), allocatable :: note
    integer :: i

    if (.not. present(library)) then
      call add_error(errors, material%origin, "*USER MATERIAL without a subroutine", &
                     "--user FILE with the UMAT or VUMAT on the command line")
      return
    end if
    user%name = material%name
    user%kind = material%law
    user%thread_safe = ""
    if (allocated(material%thread_safe)) user%thread_safe = material%thread_safe
    user%density = material%density
    user%young = material%young
    user%poisson = material%poisson
    user%props = material%constants
    user%n_statv = material%n_state
    if (allocated(material%plasticity%heating)) user%heating = material%plasticity%heating(:3)
    call new_user_law(library, user, law, note, error)
    if (allocated(error)) then
      call add_error(errors, material%origin, error%message, "a law that can be called")
      return
    end if
    if (note /= "") call add_warning(errors, material%origin, note, &
                                     "none of these, or THREADSAFE=YES where they do no harm")
    if (.not. allocated(material%state_names)) return
    do i = 1, size(material%state_names)
      select case (upper_case(material%state_names(i)%value))
      case ("EQPS", "PEEQ")
        law%eqps_state = i
      end select
    end do
  end subroutine build_user_law

  !> Bind the law that the deck asks for; constants that it does not accept are an error.
  subroutine new_material_law(material, law, error)
    type(material_spec_t), intent(in) :: material
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(law_spec_t) :: spec

    spec%law = material%law
    spec%density = material%density
    spec%young = material%young
    spec%poisson = material%poisson
    spec%constants = material%constants
    spec%n_state = material%n_state
    spec%plasticity = material%plasticity
    call new_law(spec, law, error)
  end subroutine new_material_law

end module law_setup
