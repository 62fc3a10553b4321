!> *MATERIAL with the keywords that belong to it, among them those of user subroutines.
module material_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: to_text
  use scene, only: scene_t, material_spec_t
  use keyword_table, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                           add_example, kind_real, kind_integer, kind_name, kind_choice, &
                           kind_flag, any_number, names_material
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_integer, &
                          field_real, field_integer, field_word, all_numbers, is_option_given, &
                          n_fields, line_origin, is_filled, deck_context_t
  implicit none
  private

  public :: add_material_keywords

  character(*), parameter :: parts(*) = [character(18) :: "DENSITY", "ELASTIC", "PLASTIC", &
                                         "USER MATERIAL", "DEPVAR", "HYPERELASTIC", &
                                         "RATE DEPENDENT", "BACK STRESS", "POTENTIAL", &
                                         "ORIENTATION", "ADIABATIC HEATING"]
  integer, parameter :: plastic_part = 3, user_part = 4, hyperelastic_part = 6
  integer, parameter :: first_of_plastic = 7
  integer, parameter :: on_a_line = 8   ! constants of *USER MATERIAL

contains

  !> Add *MATERIAL and all that belongs to it.
  subroutine add_material_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "MATERIAL", "Begins a material; the keywords after it that belong "// &
                     "to *MATERIAL describe it.", names=names_material, read=read_materials, &
                     read_test=read_materials)
    call add_option(table, "NAME", kind_name, "name, for the MATERIAL option of *BLANK")
    call add_example(table, "*MATERIAL, NAME=steel")

    call add_keyword(table, "DENSITY", "Mass density.", parent="MATERIAL")
    call add_line(table, "")
    call add_field(table, "density", kind_real, "mass density", unit="mass/length^3", range="> 0")
    call add_example(table, "*DENSITY", "7.85e-9")

    call add_keyword(table, "ELASTIC", "Isotropic elastic constants.", parent="MATERIAL")
    call add_option(table, "TYPE", kind_choice, "accepted for Abaqus compatibility; elasticity "// &
                    "is isotropic", default="ISOTROPIC", choices="ISOTROPIC")
    call add_line(table, "")
    call add_field(table, "E", kind_real, "Young's modulus", unit="stress", range="> 0")
    call add_field(table, "nu", kind_real, "Poisson's ratio", range="> -1 and < 0.5")
    call add_example(table, "*ELASTIC", "210000, 0.3")

    call add_keyword(table, "HYPERELASTIC", "Neo-Hookean elasticity for large strains: energy "// &
                     "C10 (I1 - 3) + (J - 1)^2/D1, I1 without the change of volume. C10 = G/2 "// &
                     "and D1 = 2/K follow from *ELASTIC, so there are no data lines.", &
                     parent="MATERIAL")
    call add_option(table, "NEO HOOKE", kind_flag, "accepted for Abaqus compatibility; no "// &
                    "other energy is available")
    call add_example(table, "*HYPERELASTIC, NEO HOOKE")

    call add_plastic_keywords(table)
    call add_factor_keywords(table)
    call add_back_stress_keyword(table)
    call add_yield_keywords(table)

    call add_user_keywords(table)
  end subroutine add_material_keywords

  !> The hardening of the yield surface.
  subroutine add_plastic_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "PLASTIC", "Von Mises plasticity with isotropic hardening: the "// &
                     "flow stress after the equivalent plastic strain eqps. Falling curves are "// &
                     "rejected.", parent="MATERIAL")
    call add_option(table, "HARDENING", kind_choice, "hardening law; ISOTROPIC is TABLE, as "// &
                    "Abaqus calls it", default="VOCE", &
                    choices="VOCE|SWIFT|LINEAR|TABLE|ISOTROPIC|VOCE SWIFT|PERFECT")
    call add_option(table, "STRESS UPDATE", kind_choice, "stress integration (return mapping): "// &
                    "backward Euler, or the semi-implicit scheme of Cardoso and Adetoro (2017, "// &
                    "box 1), one Newton step for each of STAGES residual levels that fall "// &
                    "evenly to zero; where the flow stress rises infinitely steeply at the "// &
                    "start, the first stage solves its level exactly", default="BACKWARD EULER", &
                    choices="BACKWARD EULER|MULTISTAGE", alias="RETURN")
    call add_option(table, "STAGES", kind_integer, "residual levels of STRESS UPDATE=MULTISTAGE", &
                    default="10", range=">= 1")
    call add_hardening_lines(table)
    call add_example(table, "*PLASTIC, HARDENING=VOCE", "250, 250, 6")
  end subroutine add_plastic_keywords

  !> Factors on the flow stress: of the rate and of the heat.
  subroutine add_factor_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "RATE DEPENDENT", "Factor on the flow stress from the rate of the "// &
                     "equivalent plastic strain. COWPER SYMONDS (1957): 1 + (rate/D)^(1/p); "// &
                     "JOHNSON COOK (1983): 1 + C ln(rate/reference) above the reference rate, "// &
                     "1 below it.", parent="MATERIAL")
    call add_option(table, "TYPE", kind_choice, "formula of the factor", &
                    choices="COWPER SYMONDS|JOHNSON COOK")
    call add_line(table, "", when="COWPER SYMONDS")
    call add_field(table, "D", kind_real, "rate that doubles the flow stress", unit="1/time", &
                   range="> 0")
    call add_field(table, "p", kind_real, "exponent", range="> 0")
    call add_line(table, "", when="JOHNSON COOK")
    call add_field(table, "C", kind_real, "growth of the factor with the logarithm of the rate", &
                   range=">= 0")
    call add_field(table, "reference", kind_real, "rate of the curve of *PLASTIC", &
                   unit="1/time", range="> 0")
    call add_example(table, "*RATE DEPENDENT, TYPE=COWPER SYMONDS", "40, 5")

    call add_keyword(table, "ADIABATIC HEATING", "Plastic work heats the points (Taylor and "// &
                     "Quinney 1934), without conduction, by fraction*work/(density*c), and "// &
                     "heat softens them: factor 1 - ((T - T_ref)/(T_melt - T_ref))^m on the "// &
                     "flow stress (Johnson and Cook 1983), 1 below T_ref, at least 0.001. T is "// &
                     "that at the start of the increment. Softening localizes strain in single "// &
                     "elements once it outruns the hardening. With *USER MATERIAL the work "// &
                     "that the subroutine reports (SPD + SCD, enerInelas) heats TEMP.", &
                     parent="MATERIAL")
    call add_line(table, "")
    call add_field(table, "fraction", kind_real, "fraction of plastic work that turns into heat", &
                   default="0.9", range=">= 0 and <= 1")
    call add_field(table, "c", kind_real, "specific heat", unit="energy/mass/temperature", &
                   range="> 0")
    call add_field(table, "T_start", kind_real, "temperature at the start", unit="temperature")
    call add_field(table, "T_ref", kind_real, "temperature of the curve of *PLASTIC, which "// &
                   "needs it", unit="temperature", is_required=.false.)
    call add_field(table, "T_melt", kind_real, "melting temperature, with *PLASTIC", &
                   unit="temperature", is_required=.false.)
    call add_field(table, "m", kind_real, "exponent", default="1", range="> 0")
    call add_example(table, "*ADIABATIC HEATING", "0.9, 4.6e8, 20, 20, 1500, 1")
  end subroutine add_factor_keywords

  !> Kinematic hardening.
  subroutine add_back_stress_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "BACK STRESS", "Kinematic hardening for springback and cyclic "// &
                     "loads: back stresses of Armstrong and Frederick (1966), several as "// &
                     "Chaboche (1986). Each grows by 2/3 C deps_p - gamma alpha deqps, deps_p "// &
                     "being the plastic strain, and the yield function takes the stress less "// &
                     "their sum. In tension of an isotropic material it reaches (C/gamma) (1 - "// &
                     "exp(-gamma eqps)), on top of the curve of *PLASTIC. With *POTENTIAL they "// &
                     "are kept in the axes of the material. C and gamma are those of "// &
                     "HARDENING=COMBINED, DATA TYPE=PARAMETERS in Abaqus, with the three "// &
                     "numbers of its *CYCLIC HARDENING, PARAMETERS after *PLASTIC, "// &
                     "HARDENING=VOCE. In shear beyond 1 a back stress with small gamma brings "// &
                     "too little shear stress (Jaumann rate); runs warn.", parent="MATERIAL")
    call add_option(table, "HARDENING", kind_choice, "accepted for Abaqus compatibility", &
                    default="COMBINED", choices="COMBINED")
    call add_line(table, "One line per back stress.", n_max=any_number)
    call add_field(table, "C", kind_real, "slope at the start", unit="stress", range="> 0")
    call add_field(table, "gamma", kind_real, "rate of saturation; 0: linear", range=">= 0")
    call add_example(table, "*BACK STRESS", "20000, 200", "1500, 10")
  end subroutine add_back_stress_keyword

  subroutine add_yield_keywords(table)
    type(keyword_table_t), intent(inout) :: table
    integer :: i

    call add_keyword(table, "POTENTIAL", "Anisotropic yield function, with associated flow, "// &
                     "instead of von Mises; its axes are those of *ORIENTATION. The curve of "// &
                     "*PLASTIC is that of the equivalent stress. YLD91 (Barlat, Lege and Brem "// &
                     "1991): |S1-S2|^m + |S2-S3|^m + |S3-S1|^m = 2 sigma^m with the principal "// &
                     "values of a transform of the stress, YLD2004 (Yld2004-18p, Barlat et al. "// &
                     "2005): the sum of |S'i-S''j|^m = 4 sigma^m with two of them.", &
                     parent="MATERIAL")
    call add_option(table, "TYPE", kind_choice, "yield function", choices="HILL48|YLD91|YLD2004")
    call add_line(table, "r-values of Hill's function of 1948, scaled to tension along the "// &
                  "rolling direction; L = M = 3/2 for shear through the thickness.", when="HILL48")
    call add_field(table, "r_0", kind_real, "r-value along the rolling direction", range="> 0")
    call add_field(table, "r_45", kind_real, "r-value at 45 degrees from it", range="> 0")
    call add_field(table, "r_90", kind_real, "r-value across it", range="> 0")
    call add_line(table, "Coefficients, all 1 for an isotropic sheet.", when="YLD91")
    do i = 1, 6
      call add_field(table, "c"//achar(iachar("0") + i), kind_real, weights(i))
    end do
    call add_field(table, "m", kind_real, "exponent, about 6 for bcc, 8 for fcc metals", &
                   range=">= 2 and <= 100")
    call add_line(table, "c'12, c'13, c'21, c'23, c'31, c'32, c'44, c'55, c'66, the same nine "// &
                  "of c'', and the exponent m; any number on a line. 44, 55, 66 weigh the "// &
                  "shears 23, 13, 12. All coefficients are 1 for an isotropic sheet.", &
                  when="YLD2004", n_max=any_number, is_repeated=.true.)
    call add_field(table, "coefficient", kind_real, "one of the 19 numbers")
    call add_example(table, "*POTENTIAL, TYPE=HILL48", "1.8, 1.5, 2.2")

    call add_keyword(table, "ORIENTATION", "Axes of the material at the start: 1, the rolling "// &
                     "direction, along a; 3, the normal of the sheet, along a x b. They turn "// &
                     "with the material.", parent="MATERIAL")
    call add_option(table, "NAME", kind_name, "accepted for Abaqus compatibility; the axes are "// &
                    "those of the *MATERIAL before it", is_required=.false.)
    call add_option(table, "SYSTEM", kind_choice, "accepted for Abaqus compatibility", &
                    default="RECTANGULAR", choices="RECTANGULAR")
    call add_option(table, "DEFINITION", kind_choice, "accepted for Abaqus compatibility", &
                    default="COORDINATES", choices="COORDINATES")
    call add_line(table, "")
    do i = 1, 6
      call add_field(table, merge("a", "b", i <= 3)//achar(iachar("x") + mod(i - 1, 3)), &
                     kind_real, merge("rolling direction         ", &
                                      "a vector across, in plane ", i <= 3))
    end do
    call add_line(table, "A further rotation, which must be none.", n_min=0)
    call add_field(table, "axis", kind_integer, "axis of the rotation", range=">= 1 and <= 3")
    call add_field(table, "angle", kind_real, "angle, 0", default="0")
    call add_example(table, "*ORIENTATION", "1, 0, 0, 0, 1, 0")
  end subroutine add_yield_keywords

  !> What the coefficient c_i of Yld91 weighs.
  pure function weights(i) result(text)
    integer, intent(in) :: i
    character(:), allocatable :: text
    character(*), parameter :: parts(6) = [character(22) :: "difference 22 - 33", &
      "difference 33 - 11", "difference 11 - 22", "shear 23", "shear 13", "shear 12"]

    text = "weight of the "//trim(parts(i))
  end function weights

  !> Constants of *PLASTIC. Signs that would let the flow stress fall are left to the law, which
  !! says why they are refused.
  subroutine add_hardening_lines(table)
    type(keyword_table_t), intent(inout) :: table

    call add_line(table, "sigma_0 + Q (1 - exp(-b eqps)), Voce (1948): 500 - 250 exp(-6 eqps) "// &
                  "is 250, 250, 6.", when="VOCE")
    call add_voce_fields(table)
    call add_line(table, "K (eps_0 + eqps)^n, Swift (1952); eps_0 = 0 is Hollomon (1945), "// &
                  "which yields from the start.", when="SWIFT")
    call add_swift_fields(table)
    call add_line(table, "sigma_0 + H eqps.", when="LINEAR")
    call add_field(table, "sigma_0", kind_real, "initial yield stress", unit="stress", range="> 0")
    call add_field(table, "H", kind_real, "hardening modulus, at least 0", unit="stress")
    call add_line(table, "Points of the curve from plastic strain 0 on; linear between them, "// &
                  "constant after the last.", when="TABLE|ISOTROPIC", n_max=any_number)
    call add_field(table, "stress", kind_real, "flow stress", unit="stress", range="> 0")
    call add_field(table, "plastic strain", kind_real, "equivalent plastic strain", range=">= 0")
    call add_line(table, "alpha times Swift plus 1 - alpha times Voce, Roth and Mohr (2014).", &
                  when="VOCE SWIFT")
    call add_field(table, "alpha", kind_real, "fraction of Swift", range=">= 0 and <= 1")
    call add_swift_fields(table)
    call add_voce_fields(table)
    call add_line(table, "No hardening: sigma_0 always.", when="PERFECT")
    call add_field(table, "sigma_0", kind_real, "yield stress", unit="stress", range="> 0")
  end subroutine add_hardening_lines

  subroutine add_voce_fields(table)
    type(keyword_table_t), intent(inout) :: table

    call add_field(table, "sigma_0", kind_real, "initial yield stress", unit="stress", range="> 0")
    call add_field(table, "Q", kind_real, "hardening in all, at least 0", unit="stress")
    call add_field(table, "b", kind_real, "rate of saturation, at least 0")
  end subroutine add_voce_fields

  subroutine add_swift_fields(table)
    type(keyword_table_t), intent(inout) :: table

    call add_field(table, "K", kind_real, "strength", unit="stress", range="> 0")
    call add_field(table, "eps_0", kind_real, "strain offset", range=">= 0")
    call add_field(table, "n", kind_real, "exponent, 0 to 1")
  end subroutine add_swift_fields

  !> Add *USER MATERIAL and *DEPVAR, as the decks of such subroutines write them.
  subroutine add_user_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "USER MATERIAL", "Law of a user's subroutine UMAT or VUMAT, given "// &
                     "by `--user FILE`. Where DDSDDE (or the first stress of a VUMAT) is not "// &
                     "positive at the start, *ELASTIC is needed too, for the stable time "// &
                     "increment.", parent="MATERIAL")
    call add_option(table, "CONSTANTS", kind_integer, "number of constants, NPROPS", range=">= 0", &
                    alias="CONST")
    call add_option(table, "TYPE", kind_choice, "interface of the subroutine; without it, that "// &
                    "which the file has, a UMAT before a VUMAT. MECHANICAL is accepted and "// &
                    "ignored", choices="UMAT|VUMAT|MECHANICAL", is_required=.false.)
    call add_option(table, "THREADSAFE", kind_choice, "NO: one thread, in the order of the "// &
                    "elements. Without it NO where the compiled files keep data of their own "// &
                    "(COMMON, SAVE, DATA), else YES", choices="YES|NO", is_required=.false.)
    call add_option(table, "UNSYMM", kind_flag, "accepted and ignored: no equations are solved")
    call add_option(table, "HYBRID FORMULATION", kind_name, "ignored with a warning: there are "// &
                    "no hybrid elements", is_required=.false.)
    call add_line(table, "The constants PROPS, eight on a line. Empty fields and the ends of "// &
                  "shorter lines count as zeros, as in Abaqus.", n_min=0, n_max=any_number, &
                  is_repeated=.true.)
    call add_field(table, "constant", kind_real, "one constant", default="0")
    call add_example(table, "*USER MATERIAL, CONSTANTS=5", "210000, 0.3, 250, 250, 6")

    call add_keyword(table, "DEPVAR", "State variables of the user material. One that is named "// &
                     "EQPS or PEEQ is shown as the equivalent plastic strain.", parent="MATERIAL")
    call add_option(table, "DELETE", kind_integer, "accepted and ignored: no element is removed", &
                    is_required=.false., range=">= 1")
    call add_line(table, "")
    call add_field(table, "NSTATV", kind_integer, "number of state variables", &
                   range=">= 0 and <= 10000")
    call add_line(table, "Names of state variables, if they shall have any.", n_min=0, &
                  n_max=any_number)
    call add_field(table, "number", kind_integer, "which one", range=">= 1")
    call add_field(table, "name", kind_name, "its name in the result file")
    call add_field(table, "description", kind_name, "any text", is_required=.false.)
    call add_example(table, "*DEPVAR", "1", "1, EQPS, ""equivalent plastic strain""")
  end subroutine add_user_keywords

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
        if (has(part, i) > 0) then
          call add_error(errors, deck%records(behind(j))%origin, &
                         "the keyword a second time for one material", "one in each *MATERIAL")
        end if
        has(part, i) = behind(j)
      end do
    end do
    found = find_records(deck, "MATERIAL")
    allocate (scene%materials(size(found)))
    do i = 1, size(found)
      associate (material => scene%materials(i), record => deck%records(found(i)))
        material%origin = record%origin
        material%name = option_text(record, "NAME")
        call read_law(deck, has(:, found(i)), material, errors)
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
    if (has(5) > 0 .and. has(4) == 0) then
      call add_error(errors, deck%records(has(5))%origin, "no *USER MATERIAL in this material", &
                     "*DEPVAR only with *USER MATERIAL")
    end if
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
    end select
  end subroutine read_part

  !> What belongs to *PLASTIC needs it.
  subroutine check_plastic_parts(deck, has, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: has(:)
    type(error_list_t), intent(inout) :: errors
    integer :: part

    do part = first_of_plastic, size(parts)
      if (has(part) == 0) cycle
      if (parts(part) == "ADIABATIC HEATING") call check_heating(deck, has, part, errors)
      if (has(plastic_part) > 0) cycle
      if (parts(part) == "ADIABATIC HEATING" .and. has(user_part) > 0) cycle
      if (parts(part) == "ORIENTATION" .and. has(user_part) > 0) then
        call add_error(errors, deck%records(has(part))%origin, "axes for *USER MATERIAL", &
                       "none: a UMAT is given components along x, y, z and DROT, a VUMAT those "// &
                       "that turn with the material from x, y, z on (see docs/user-materials.md)")
        cycle
      end if
      call add_error(errors, deck%records(has(part))%origin, "no *PLASTIC in this material", &
                     "*"//trim(parts(part))//" only with *PLASTIC")
    end do
  end subroutine check_plastic_parts

  !> The temperatures of softening are those of *PLASTIC.
  subroutine check_heating(deck, has, part, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: has(:), part
    type(error_list_t), intent(inout) :: errors

    associate (record => deck%records(has(part)))
      if (has(plastic_part) == 0 .or. .not. record%is_valid) return
      if (is_filled(record, 1, 4) .and. is_filled(record, 1, 5)) return
      call add_error(errors, record%origin, "no T_ref or no T_melt", "both with *PLASTIC")
    end associate
  end subroutine check_heating

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
      if (number <= material%n_state) then
        material%state_names(number)%value = field_word(record, line, 2)
      else
        call add_error(errors, line_origin(deck, record, line), "the name of state variable "// &
                       to_text(number), "a number up to NSTATV, which is "// &
                       to_text(material%n_state))
      end if
    end do
  end subroutine read_state_names

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

  !> The constants as Abaqus places them: eight on a line, blank places and the ends of shorter
  !! lines count as zeros.
  subroutine read_constants(deck, record, material, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_spec_t), intent(inout) :: material
    type(error_list_t), intent(inout) :: errors
    integer :: n, line, n_wanted, n_given

    n = option_integer(record, "CONSTANTS")
    n_wanted = (n + on_a_line - 1)/on_a_line
    if (record%n_lines /= n_wanted) then
      call add_error(errors, record%origin, to_text(record%n_lines)//" data lines", &
                     to_text(n_wanted)//" for CONSTANTS="//to_text(n)//": eight constants on "// &
                     "each, of which a shorter one is filled up with zeros")
      return
    end if
    material%constants = spread(0.0_wp, 1, n)
    do line = 1, n_wanted
      n_given = n_fields(record, line)
      associate (before => on_a_line*(line - 1))
        if (n_given > min(on_a_line, n - before)) then
          call add_error(errors, line_origin(deck, record, line), to_text(n_given)// &
                         " constants on a line", to_text(min(on_a_line, n - before))// &
                         " at most: eight on each line, "//to_text(n)//" in all")
          cycle
        end if
        associate (first => record%first(line))
          material%constants(before + 1:before + n_given) = &
            record%numbers(first:first + n_given - 1)
        end associate
      end associate
    end do
  end subroutine read_constants

end module material_keywords
