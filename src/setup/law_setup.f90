!> The law of a material: one of the table, or a user's.
module law_setup
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: upper_case, rounded_text
  use scene, only: material_spec_t, is_user_material, origin_of_part
  use block_law, only: block_law_t
  use material_table, only: new_law
  use part_conflicts, only: part_conflict_t, find_part_conflicts
  use user_library, only: user_library_t
  use user_law, only: new_user_law
  implicit none
  private

  public :: build_law, refuse_call

contains

  !> The law with its constants checked; not allocated where an error was added.
  subroutine build_law(material, law, errors, library, n_fields)
    type(material_spec_t), intent(in) :: material
    class(block_law_t), allocatable, intent(out) :: law
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library   !! subroutines of the user
    integer, intent(in), optional :: n_fields   !! temperature and field variables of the deck
    type(part_conflict_t), allocatable :: conflicts(:)
    type(error_t), allocatable :: error
    character(:), allocatable :: note
    integer :: i, n_own

    if (.not. is_user_material(material)) then
      call find_part_conflicts(material%law_spec_t, conflicts)
      do i = 1, size(conflicts)
        call add_error(errors, origin_of_part(material, conflicts(i)%keyword), &
                       conflicts(i)%found, conflicts(i)%expected)
      end do
      if (size(conflicts) > 0) return
      call new_law(material%law_spec_t, law, error)
      if (allocated(error)) call refuse(material, error, errors)
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
      call refuse_call(material, error, errors)
      return
    end if
    if (note /= "") call add_warning(errors, material%origin, note, &
                                     "none of these, or THREADSAFE=YES where they do no harm")
    if (.not. allocated(material%state_names)) return
    do i = 1, size(material%state_names)
      if (any(upper_case(material%state_names(i)%value) == ["EQPS", "PEEQ"])) law%eqps_state = i
    end do
  end subroutine build_law

  !> At the keyword that the error is about, with its numbers.
  subroutine refuse(material, error, errors)
    type(material_spec_t), intent(in) :: material
    type(error_t), intent(in) :: error
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: most_numbers = 10
    character(:), allocatable :: why, numbers
    integer :: i

    why = reason_of(error)
    numbers = ""
    if (.not. allocated(error%keyword)) then
      call add_error(errors, material%origin, why, "other constants")
      return
    end if
    associate (values => numbers_of(material, error%keyword, error%number))
      do i = 1, min(size(values), most_numbers)
        numbers = numbers//", "//rounded_text(values(i))
      end do
      if (size(values) > most_numbers) numbers = numbers//", ..."
    end associate
    call add_error(errors, origin_of_part(material, error%keyword, error%number), &
                   "the numbers "//numbers(3:)//": "//why, "what input/KEYWORDS.md says under "// &
                   error%keyword)
  end subroutine refuse

  !> A subroutine of the user that cannot be called as the deck says.
  subroutine refuse_call(material, error, errors)
    type(material_spec_t), intent(in) :: material
    type(error_t), intent(in) :: error
    type(error_list_t), intent(inout) :: errors

    call add_error(errors, material%origin, "the subroutine of '"//material%name//"': "// &
                   reason_of(error), "a subroutine that can be called as the deck says")
  end subroutine refuse_call

  !> What is wrong with a law.
  pure function reason_of(error) result(why)
    type(error_t), intent(in) :: error
    character(:), allocatable :: why
    character(*), parameter :: prefix = "material: "

    why = error%message
    if (index(why, prefix) == 1) why = why(len(prefix) + 1:)
  end function reason_of

  !> What a deck gives with a keyword of plasticity.
  pure function numbers_of(material, keyword, number) result(numbers)
    type(material_spec_t), intent(in) :: material
    character(*), intent(in) :: keyword
    integer, intent(in) :: number          !! which of several such keywords
    real(wp), allocatable :: numbers(:)

    associate (plasticity => material%plasticity)
      select case (keyword)
      case ("*RATE DEPENDENT"); numbers = plasticity%rate_constants
      case ("*ADIABATIC HEATING"); numbers = plasticity%heating
      case ("*BACK STRESS"); numbers = plasticity%back_stresses
      case ("*DAMAGE INITIATION"); numbers = plasticity%damage
      case ("*UNLOADING MODULUS"); numbers = plasticity%unloading
      case ("*POTENTIAL"); numbers = plasticity%coefficients
      case ("*ORIENTATION"); numbers = plasticity%orientation
      case default
        numbers = material%constants
        if (number > 1) numbers = plasticity%rate_curves(number)%points
      end select
    end associate
  end function numbers_of

end module law_setup
