!> The entries of the keyword table for materials.
module material_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_real, kind_integer, kind_name, kind_choice, &
                          kind_flag, any_number
  use user_keywords, only: add_user_keywords
  implicit none
  private

  public :: add_material_keywords

contains

  !> Add *MATERIAL and all that belongs to it.
  pure subroutine add_material_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "MATERIAL", "Begins a material; the keywords behind it that belong "// &
                     "to *MATERIAL describe it.")
    call add_option(table, "NAME", kind_name, "name, for the MATERIAL option of *BLANK")
    call add_example(table, "*MATERIAL, NAME=steel")

    call add_keyword(table, "DENSITY", "Mass density.", parent="MATERIAL")
    call add_line(table, "")
    call add_field(table, "density", kind_real, "mass density", unit="mass/length^3", range="> 0")
    call add_example(table, "*DENSITY")
    call add_example(table, "7.85e-9")

    call add_keyword(table, "ELASTIC", "Isotropic elastic constants.", parent="MATERIAL")
    call add_option(table, "TYPE", kind_choice, "may be given; no other elasticity is there", &
                    default="ISOTROPIC", choices="ISOTROPIC")
    call add_line(table, "")
    call add_field(table, "E", kind_real, "Young's modulus", unit="stress", range="> 0")
    call add_field(table, "nu", kind_real, "Poisson's ratio", range="> -1 and < 0.5")
    call add_example(table, "*ELASTIC")
    call add_example(table, "210000, 0.3")

    call add_keyword(table, "HYPERELASTIC", "Neo-Hookean elasticity for large strains: energy "// &
                     "C10 (I1 - 3) + (J - 1)^2/D1, I1 without the change of volume. C10 = G/2 "// &
                     "and D1 = 2/K follow from *ELASTIC, so there are no data lines.", &
                     parent="MATERIAL")
    call add_option(table, "NEO HOOKE", kind_flag, "may be given; no other energy is there")
    call add_example(table, "*HYPERELASTIC, NEO HOOKE")

    call add_plastic_keywords(table)
    call add_factor_keywords(table)
    call add_back_stress_keyword(table)
    call add_yield_keywords(table)

    call add_user_keywords(table)
  end subroutine add_material_keywords

  !> The hardening of the yield surface.
  pure subroutine add_plastic_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "PLASTIC", "Von Mises plasticity with isotropic hardening: the "// &
                     "flow stress after the equivalent plastic strain eqps. Curves that fall "// &
                     "are refused.", parent="MATERIAL")
    call add_option(table, "HARDENING", kind_choice, "hardening law; ISOTROPIC is TABLE, as "// &
                    "Abaqus calls it", default="VOCE", &
                    choices="VOCE|SWIFT|LINEAR|TABLE|ISOTROPIC|VOCE SWIFT|PERFECT")
    call add_option(table, "RETURN", kind_choice, "return to the yield surface: backward "// &
                    "Euler, or the semi-implicit scheme of Cardoso and Adetoro (2017, box 1), "// &
                    "one Newton step for each of STAGES residual levels that fall evenly to "// &
                    "zero; where the flow stress rises infinitely steeply at the start, the "// &
                    "first stage solves its level exactly", &
                    default="BACKWARD EULER", choices="BACKWARD EULER|MULTISTAGE")
    call add_option(table, "STAGES", kind_integer, "residual levels of RETURN=MULTISTAGE", &
                    default="10", range=">= 1")
    call add_hardening_lines(table)
    call add_example(table, "*PLASTIC, HARDENING=VOCE")
    call add_example(table, "250, 250, 6")
  end subroutine add_plastic_keywords

  !> Factors on the flow stress: of the rate and of the heat.
  pure subroutine add_factor_keywords(table)
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
    call add_example(table, "*RATE DEPENDENT, TYPE=COWPER SYMONDS")
    call add_example(table, "40, 5")

    call add_keyword(table, "ADIABATIC HEATING", "Plastic work heats the points (Taylor and "// &
                     "Quinney 1934), without conduction, by fraction*work/(density*c), and "// &
                     "heat softens them: factor 1 - ((T - T_ref)/(T_melt - T_ref))^m on the "// &
                     "flow stress (Johnson and Cook 1983), 1 below T_ref, at least 0.001. T is "// &
                     "that at the start of the increment. Softening gathers strain in single "// &
                     "elements once it outruns the hardening. With *USER MATERIAL the "// &
                     "work that the subroutine reports (SPD + SCD, enerInelas) heats TEMP.", &
                     parent="MATERIAL")
    call add_line(table, "")
    call add_field(table, "fraction", kind_real, "share of plastic work that turns into heat", &
                   default="0.9", range=">= 0 and <= 1")
    call add_field(table, "c", kind_real, "specific heat", unit="energy/mass/temperature", &
                   range="> 0")
    call add_field(table, "T_start", kind_real, "temperature at the start", unit="temperature")
    call add_field(table, "T_ref", kind_real, "temperature of the curve of *PLASTIC, which "// &
                   "needs it", unit="temperature", is_required=.false.)
    call add_field(table, "T_melt", kind_real, "melting temperature, with *PLASTIC", &
                   unit="temperature", is_required=.false.)
    call add_field(table, "m", kind_real, "exponent", default="1", range="> 0")
    call add_example(table, "*ADIABATIC HEATING")
    call add_example(table, "0.9, 4.6e8, 20, 20, 1500, 1")
  end subroutine add_factor_keywords

  !> Kinematic hardening.
  pure subroutine add_back_stress_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "BACK STRESS", "Kinematic hardening for springback and cyclic "// &
                     "loads: back stresses of Armstrong and Frederick (1966), several as "// &
                     "Chaboche (1986). Each grows by 2/3 C deps_p - gamma alpha deqps, deps_p "// &
                     "being the plastic strain, and the yield function takes the stress less "// &
                     "their sum. In tension of an isotropic material it reaches (C/gamma) "// &
                     "(1 - exp(-gamma eqps)), on top of the curve of *PLASTIC. With *POTENTIAL "// &
                     "they are kept in the axes of the material. C and gamma are "// &
                     "those of HARDENING=COMBINED, DATA TYPE=PARAMETERS in Abaqus, with the "// &
                     "three numbers of its *CYCLIC HARDENING, PARAMETERS behind *PLASTIC, "// &
                     "HARDENING=VOCE. In shear beyond 1 a back stress with small gamma brings "// &
                     "too little shear stress (Jaumann rate); runs warn.", parent="MATERIAL")
    call add_line(table, "One line for each back stress.", n_max=any_number)
    call add_field(table, "C", kind_real, "slope at the start", unit="stress", range="> 0")
    call add_field(table, "gamma", kind_real, "rate of saturation; 0: linear", range=">= 0")
    call add_example(table, "*BACK STRESS")
    call add_example(table, "20000, 200")
    call add_example(table, "1500, 10")
  end subroutine add_back_stress_keyword

  pure subroutine add_yield_keywords(table)
    type(keyword_table_t), intent(inout) :: table
    integer :: i

    call add_keyword(table, "POTENTIAL", "Anisotropic yield function, with associated flow, in "// &
                     "place of von Mises; its axes are those of *ORIENTATION. The curve of "// &
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
    call add_example(table, "*POTENTIAL, TYPE=HILL48")
    call add_example(table, "1.8, 1.5, 2.2")

    call add_keyword(table, "ORIENTATION", "Axes of the material at the start: 1, the rolling "// &
                     "direction, along a; 3, the normal of the sheet, along a x b. They turn "// &
                     "with the material.", parent="MATERIAL")
    call add_option(table, "NAME", kind_name, "may be given; the place behind *MATERIAL says "// &
                    "whose axes they are", is_required=.false.)
    call add_option(table, "SYSTEM", kind_choice, "may be given", default="RECTANGULAR", &
                    choices="RECTANGULAR")
    call add_option(table, "DEFINITION", kind_choice, "may be given", default="COORDINATES", &
                    choices="COORDINATES")
    call add_line(table, "")
    do i = 1, 6
      call add_field(table, merge("a", "b", i <= 3)//achar(iachar("x") + mod(i - 1, 3)), &
                     kind_real, merge("rolling direction         ", &
                                      "a vector across, in plane ", i <= 3))
    end do
    call add_line(table, "A further rotation, which must be none.", n_min=0)
    call add_field(table, "axis", kind_integer, "axis of the rotation", range=">= 1 and <= 3")
    call add_field(table, "angle", kind_real, "angle, 0", default="0")
    call add_example(table, "*ORIENTATION")
    call add_example(table, "1, 0, 0, 0, 1, 0")
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
  pure subroutine add_hardening_lines(table)
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
                  "constant behind the last.", when="TABLE|ISOTROPIC", n_max=any_number)
    call add_field(table, "stress", kind_real, "flow stress", unit="stress", range="> 0")
    call add_field(table, "plastic strain", kind_real, "equivalent plastic strain", range=">= 0")
    call add_line(table, "alpha times Swift plus 1 - alpha times Voce, Roth and Mohr (2014).", &
                  when="VOCE SWIFT")
    call add_field(table, "alpha", kind_real, "share of Swift", range=">= 0 and <= 1")
    call add_swift_fields(table)
    call add_voce_fields(table)
    call add_line(table, "No hardening: sigma_0 always.", when="PERFECT")
    call add_field(table, "sigma_0", kind_real, "yield stress", unit="stress", range="> 0")
  end subroutine add_hardening_lines

  pure subroutine add_voce_fields(table)
    type(keyword_table_t), intent(inout) :: table

    call add_field(table, "sigma_0", kind_real, "initial yield stress", unit="stress", range="> 0")
    call add_field(table, "Q", kind_real, "hardening in all, at least 0", unit="stress")
    call add_field(table, "b", kind_real, "rate of saturation, at least 0")
  end subroutine add_voce_fields

  pure subroutine add_swift_fields(table)
    type(keyword_table_t), intent(inout) :: table

    call add_field(table, "K", kind_real, "strength", unit="stress", range="> 0")
    call add_field(table, "eps_0", kind_real, "strain offset", range=">= 0")
    call add_field(table, "n", kind_real, "exponent, 0 to 1")
  end subroutine add_swift_fields

end module material_keywords
