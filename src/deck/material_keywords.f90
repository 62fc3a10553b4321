!> *MATERIAL with the keywords that belong to it, among them those of user subroutines.
module material_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, n_errors, add_error, add_warning
  use text, only: string_t, to_text, upper_case, counted
  use law_spec, only: rate_curve_spec_t
  use scene, only: scene_t, material_spec_t
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_integer, &
                          option_real, is_option_given, field_real, field_integer, field_word, &
                          all_numbers, n_fields, line_origin, is_filled, deck_context_t
  implicit none
  private

  public :: read_materials

  character(*), parameter :: parts(*) = [character(21) :: "DENSITY", "ELASTIC", "PLASTIC", &
                                         "USER MATERIAL", "DEPVAR", "HYPERELASTIC", &
                                         "USER DEFINED FIELD", "USER OUTPUT VARIABLES", &
                                         "RATE DEPENDENT", "BACK STRESS", "POTENTIAL", &
                                         "ORIENTATION", "ADIABATIC HEATING", &
                                         "UNLOADING MODULUS", "DAMAGE INITIATION"]
  integer, parameter :: plastic_part = 3, user_part = 4, hyperelastic_part = 6
  integer, parameter :: of_user(3) = [5, 7, 8]   ! need *USER MATERIAL
  integer, parameter :: first_of_plastic = 9
  integer, parameter :: on_a_line = 8   ! constants of *USER MATERIAL

contains

  !> Fill the list of materials, one for each *MATERIAL in the order of the deck.
  subroutine read_materials(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:), behind(:)
    integer, allocatable :: has(:, :)   ! record of each part, by that of *MATERIAL
    integer :: i, j, part

    allocate (has(size(parts), size(deck%records)), source=0)
    do part = 1, size(parts)
      behind = find_records(deck, trim(parts(part)))
      do j = 1, size(behind)
        i = deck%records(behind(j))%parent
        if (i == 0) cycle
        if (has(part, i) == 0) then
          has(part, i) = behind(j)
        else if (part /= plastic_part) then
          call add_error(errors, deck%records(behind(j))%origin, &
                         "the keyword a second time for one material", "one in each *MATERIAL")
        end if
      end do
    end do
    found = find_records(deck, "MATERIAL")
    allocate (scene%materials(size(found)))
    do i = 1, size(found)
      associate (material => scene%materials(i), record => deck%records(found(i)))
        material%origin = record%origin
        material%name = option_text(record, "NAME")
        call read_law(deck, has(:, found(i)), material, errors)
        if (material%law == "PLASTIC") call read_rate_curves(deck, found(i), material, errors)
      end associate
    end do
  end subroutine read_materials

  !> All parts of a material, and whether they belong together.
  subroutine read_law(deck, has, material, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: has(:)   !! record of each part, 0: none
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors
    integer :: part

    material%law = "ELASTIC"
    allocate (material%constants(0))
    material%parts = deck%records(pack(has, has > 0))%origin
    do part = 1, size(parts)
      if (has(part) == 0) then
        if (part == 2 .and. has(4) > 0) cycle
        if (part <= 2) call add_error(errors, material%origin, "no *"//trim(parts(part))// &
                                      " after it", "*"//trim(parts(part))//" with its data line")
        cycle
      end if
      associate (record => deck%records(has(part)))
        if (.not. record%is_valid) cycle
        call read_part(deck, record, trim(parts(part)), material, errors)
      end associate
    end do
    call check_one_law(deck, has, errors)
    do part = 1, size(of_user)
      if (has(of_user(part)) == 0 .or. has(user_part) > 0) cycle
      call add_error(errors, deck%records(has(of_user(part)))%origin, &
                     "no *USER MATERIAL in this material", &
                     "*"//trim(parts(of_user(part)))//" only with *USER MATERIAL")
    end do
    call check_plastic_parts(deck, has, errors)
  end subroutine read_law

  !> One part of a material.
  subroutine read_part(deck, record, part, material, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: part
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors

    select case (part)
    case ("DENSITY")
      material%density = field_real(record, 1, 1)
    case ("ELASTIC")
      material%young = field_real(record, 1, 1)
      material%poisson = field_real(record, 1, 2)
    case ("PLASTIC")
      call read_plastic(record, material)
    case ("RATE DEPENDENT")
      material%plasticity%rate = option_text(record, "TYPE")
      material%plasticity%rate_constants = all_numbers(record)
    case ("BACK STRESS")
      material%plasticity%back_stresses = all_numbers(record)
    case ("DAMAGE INITIATION")
      material%plasticity%damage = all_numbers(record)
    case ("UNLOADING MODULUS")
      material%plasticity%unloading = all_numbers(record)
    case ("POTENTIAL")
      material%plasticity%potential = option_text(record, "TYPE")
      material%plasticity%coefficients = all_numbers(record)
    case ("ORIENTATION")
      call read_orientation(record, material, errors)
    case ("ADIABATIC HEATING")
      material%plasticity%heating = all_numbers(record)
    case ("HYPERELASTIC")
      material%law = "NEO HOOKE"
    case ("USER MATERIAL")
      call read_user_material(deck, record, material, errors)
    case ("DEPVAR")
      call read_state_names(deck, record, material, errors)
      if (is_option_given(record, "DELETE")) then
        call add_warning(errors, record%origin, "DELETE="//option_text(record, &
                         "DELETE"), "none, for no element is ever removed: points that "// &
                         "the subroutine deletes keep the stress it returns")
      end if
    case ("USER DEFINED FIELD")
      material%has_own_fields = .true.
    case ("USER OUTPUT VARIABLES")
      call read_output_variables(record, material)
    end select
  end subroutine read_part

  !> What belongs to *PLASTIC needs it. The temperatures of softening are those of *PLASTIC.
  subroutine check_plastic_parts(deck, has, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: has(:)
    type(error_list_t), intent(inout) :: errors
    integer :: part

    do part = first_of_plastic, size(parts)
      if (has(part) == 0) cycle
      associate (record => deck%records(has(part)))
        if (has(plastic_part) > 0) then
          if (parts(part) /= "ADIABATIC HEATING" .or. .not. record%is_valid) cycle
          if (is_filled(record, 1, 4) .and. is_filled(record, 1, 5)) cycle
          call add_error(errors, record%origin, "no T_ref or no T_melt", "both with *PLASTIC")
        else if (has(user_part) > 0 .and. parts(part) == "ADIABATIC HEATING") then
          cycle
        else if (has(user_part) > 0 .and. parts(part) == "ORIENTATION") then
          call add_error(errors, record%origin, "axes for *USER MATERIAL", "none: a UMAT is "// &
                         "given components along x, y, z and DROT, a VUMAT those that turn "// &
                         "with the material from x, y, z on (see docs/user-materials.md)")
        else
          call add_error(errors, record%origin, "no *PLASTIC in this material", &
                         "*"//trim(parts(part))//" only with *PLASTIC")
        end if
      end associate
    end do
  end subroutine check_plastic_parts

  !> Of *PLASTIC, *USER MATERIAL and *HYPERELASTIC a material has one at most.
  subroutine check_one_law(deck, has, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: has(:)
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: laws(3) = [plastic_part, user_part, hyperelastic_part]
    integer, allocatable :: named(:)
    integer :: i

    named = pack(laws, has(laws) > 0)
    do i = 2, size(named)
      call add_error(errors, deck%records(has(named(i)))%origin, "both *"// &
                     trim(parts(named(1)))//" and *"//trim(parts(named(i))), &
                     "one law for a material")
    end do
  end subroutine check_one_law

  !> Kind, constants and thread safety of a user's law; the kind USER is any that the files have.
  subroutine read_user_material(deck, record, material, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors

    material%law = option_text(record, "TYPE")
    if (material%law /= "UMAT" .and. material%law /= "VUMAT") material%law = "USER"
    material%thread_safe = option_text(record, "THREADSAFE")
    material%is_small = option_text(record, "KINEMATICS") == "SMALL"
    material%is_of_solids = option_text(record, "STRESS STATE") == "THREE DIMENSIONAL"
    if (material%is_small .and. material%law == "VUMAT") &
      call add_error(errors, record%origin, "KINEMATICS=SMALL with TYPE=VUMAT", "FULL: the "// &
                     "frame of a VUMAT follows from the deformation gradient")
    if (is_option_given(record, "HYBRID FORMULATION")) then
      call add_warning(errors, record%origin, "HYBRID FORMULATION="//option_text(record, &
                       "HYBRID FORMULATION")//", an option that is ignored here", "none, for "// &
                       "there are no hybrid elements; PROJECTION of *BLANK says how locking "// &
                       "is avoided")
    end if
    call read_constants(deck, record, material, errors)
  end subroutine read_user_material

  !> The axes; a rotation that Abaqus would apply on top of them must be none.
  subroutine read_orientation(record, material, errors)
    type(record_t), intent(in) :: record
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: numbers(:)

    numbers = all_numbers(record)
    material%plasticity%orientation = numbers(:6)
    if (size(numbers) < 8) return
    if (abs(numbers(8)) > 0.0_wp) then
      call add_error(errors, record%origin, "a further rotation by "//to_text(numbers(8)), &
                     "vectors a and b that are rotated by it, and no angle")
    end if
  end subroutine read_orientation

  !> Number of the state variables and the names of some or all of them.
  subroutine read_state_names(deck, record, material, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors
    integer :: line, number

    material%n_state = field_integer(record, 1, 1)
    allocate (material%state_names(material%n_state))
    do number = 1, material%n_state
      material%state_names(number)%value = "SDV"//to_text(number)
    end do
    do line = 2, record%n_lines
      number = field_integer(record, line, 1)
      if (is_output_name(upper_case(field_word(record, line, 2)))) then
        call add_error(errors, line_origin(deck, record, line), "the name "// &
                       field_word(record, line, 2), "another one, for UVARM with a number is "// &
                       "that of an output variable")
      else if (number <= material%n_state) then
        material%state_names(number)%value = field_word(record, line, 2)
      else
        call add_error(errors, line_origin(deck, record, line), "the name of state variable "// &
                       to_text(number), "a number up to NSTATV, which is "// &
                       to_text(material%n_state))
      end if
    end do
  end subroutine read_state_names

  !> UVARM with a number?
  pure logical function is_output_name(name)
    character(*), intent(in) :: name   !! upper case

    is_output_name = .false.
    if (len(name) < 6) return
    is_output_name = name(:5) == "UVARM" .and. verify(name(6:), "0123456789") == 0
  end function is_output_name

  !> Number of the output variables; their names follow those of the state variables.
  subroutine read_output_variables(record, material)
    type(record_t), intent(in) :: record
    type(material_spec_t), intent(inout) :: material
    type(string_t), allocatable :: names(:)
    integer :: i

    material%n_uvarm = field_integer(record, 1, 1)
    allocate (names(material%n_state + material%n_uvarm))
    if (allocated(material%state_names)) names(:material%n_state) = material%state_names
    do i = 1, material%n_uvarm
      names(material%n_state + i)%value = "UVARM"//to_text(i)
    end do
    call move_alloc(names, material%state_names)
  end subroutine read_output_variables

  subroutine read_plastic(record, material)
    type(record_t), intent(in) :: record
    type(material_spec_t), intent(inout) :: material

    material%law = "PLASTIC"
    material%constants = all_numbers(record)
    material%plasticity%hardening = option_text(record, "HARDENING")
    if (material%plasticity%hardening == "ISOTROPIC") material%plasticity%hardening = "TABLE"
    if (option_text(record, "STRESS UPDATE") == "MULTISTAGE") then
      material%plasticity%n_stages = option_integer(record, "STAGES")
    end if
  end subroutine read_plastic

  !> The flow curves of several *PLASTIC, RATE= in one material. The first gives the other options.
  subroutine read_rate_curves(deck, parent, material, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: parent          !! record of *MATERIAL
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors
    type(rate_curve_spec_t), allocatable :: curves(:)
    integer, allocatable :: found(:)
    integer :: i, n_before

    found = find_records(deck, "PLASTIC")
    found = pack(found, deck%records(found)%parent == parent)
    n_before = n_errors(errors)
    do i = 1, size(found)
      call check_rate_curve(deck%records(found(i)), deck%records(found(1)), size(found), errors)
    end do
    if (n_errors(errors) > n_before .or. .not. all(deck%records(found)%is_valid)) return
    if (size(found) == 1) return
    allocate (curves(size(found)))
    do i = 1, size(found)
      curves(i)%rate = option_real(deck%records(found(i)), "RATE")
      curves(i)%points = all_numbers(deck%records(found(i)))
    end do
    material%plasticity%is_logarithmic = option_text(deck%records(found(1)), "INTERPOLATION") &
                                         == "LOGARITHMIC"
    material%parts = [material%parts, deck%records(found(2:))%origin]
    call move_alloc(curves, material%plasticity%rate_curves)
  end subroutine read_rate_curves

  !> One *PLASTIC beside the first of its material.
  subroutine check_rate_curve(record, first, n, errors)
    type(record_t), intent(in) :: record, first
    integer, intent(in) :: n               !! how many there are
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: shared(3) = [character(13) :: "STRESS UPDATE", "STAGES", &
                                            "INTERPOLATION"]
    character(:), allocatable :: hardening
    integer :: i

    if (.not. record%is_valid) return
    hardening = option_text(record, "HARDENING")
    if (n == 1) then
      if (is_option_given(record, "RATE") .or. &
          option_text(record, "INTERPOLATION") == "LOGARITHMIC") &
        call add_warning(errors, record%origin, "RATE or INTERPOLATION in the only *PLASTIC of "// &
                         "the material, whose curve then holds at all rates", "neither, or a "// &
                         "*PLASTIC with RATE for each rate")
      return
    end if
    if (.not. is_option_given(record, "RATE")) then
      call add_error(errors, record%origin, to_text(n)//" *PLASTIC in one material, this one "// &
                     "without RATE", "one in each *MATERIAL, or RATE in all of them")
    else if (hardening /= "ISOTROPIC" .and. hardening /= "TABLE") then
      call add_error(errors, record%origin, "HARDENING="//hardening//" with RATE", &
                     "HARDENING=ISOTROPIC (or TABLE) with a curve for each RATE")
    end if
    if (.not. first%is_valid) return
    do i = 1, size(shared)
      if (option_text(record, trim(shared(i))) == option_text(first, trim(shared(i)))) cycle
      call add_error(errors, record%origin, trim(shared(i))//"="// &
                     option_text(record, trim(shared(i)))//" for one of the curves", &
                     trim(shared(i))//"="//option_text(first, trim(shared(i)))// &
                     " as in the first *PLASTIC of the material")
    end do
  end subroutine check_rate_curve

  !> The constants as Abaqus places them: eight on a line, blank places and the ends of shorter
  !! lines count as zeros. Too few of them are warned of, for a forgotten one is a zero as well.
  subroutine read_constants(deck, record, material, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: expected, found
    integer :: n, line, n_wanted, n_given, total

    n = option_integer(record, "CONSTANTS")
    n_wanted = (n + on_a_line - 1)/on_a_line
    total = sum([(n_fields(record, line), line=1, record%n_lines)])
    expected = counted(n, "constant")//" on "//counted(n_wanted, "data line")// &
               ", eight on each, for CONSTANTS="//to_text(n)
    found = counted(total, "constant")//" on "//counted(record%n_lines, "data line")
    if (record%n_lines /= n_wanted) then
      call add_error(errors, record%origin, found, expected)
      return
    end if
    material%constants = spread(0.0_wp, 1, n)
    do line = 1, n_wanted
      n_given = n_fields(record, line)
      associate (before => on_a_line*(line - 1), first => record%first(line))
        if (n_given > min(on_a_line, n - before)) then
          call add_error(errors, line_origin(deck, record, line), counted(n_given, "constant")// &
                         " on a data line, "//to_text(total)//" in all", &
                         to_text(min(on_a_line, n - before))//" at most on this line: "//expected)
          return
        end if
        material%constants(before + 1:before + n_given) = &
          record%fields(first:first + n_given - 1)%number
      end associate
    end do
    if (total < n) call add_warning(errors, record%origin, found//"; the missing ends of the "// &
                                    "lines count as zeros, as in Abaqus", expected)
  end subroutine read_constants

end module material_keywords
