!> Hardening. Isotropic: flow stress and slope against the equivalent plastic strain. Kinematic:
!! the constants of back stresses.
!!
!! Isotropic: E. Voce, J. Inst. Metals 74 (1948); H. W. Swift, J. Mech. Phys. Solids 1 (1952);
!! mix of both: C. C. Roth and D. Mohr, Int. J. Plasticity 56 (2014), eq. (8); P. Ludwik, Elemente
!! der technologischen Mechanik, Springer 1909; J. E. Hockett and O. D. Sherby, J. Mech. Phys.
!! Solids 23 (1975).
!!
!! Kinematic: P. J. Armstrong and C. O. Frederick, CEGB report RD/B/N 731 (1966), several back
!! stresses as J. L. Chaboche, Int. J. Plasticity 2 (1986): each grows by 2/3 C deps_p - gamma alpha
!! deqps with the plastic strain deps_p, so that for von Mises C and gamma are those of a tension
!! curve. For any convex yield function gamma/C times the square of the back stress is dissipated.
module hardening
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text, rounded_text
  use constant_check, only: check_finite, check_count, require
  use row_functions, only: exp_row, exp_multiple, power_row, power_small, small_part
  implicit none
  private

  public :: new_hardening, harden, harden_after, is_steep_at_start, new_back_stresses, &
            back_stress_warning

  !> Constants of the back stresses of a law.
  type, public :: back_stresses_t
    integer :: n = 0
    real(wp), allocatable :: modulus(:)   !! C, slope at the start [stress], shape (n)
    real(wp), allocatable :: recall(:)    !! gamma, C/gamma is where it ends, shape (n)
  end type back_stresses_t

  integer, parameter, public :: voce_kind = 2
  integer, parameter :: no_hardening = 0, linear_kind = 1, swift_kind = 3, mixed_kind = 4, &
                        table_kind = 5, ludwik_kind = 6, hockett_kind = 7

  !> One hardening curve; which constants count depends on `kind`.
  type, public :: hardening_t
    integer :: kind = no_hardening
    real(wp) :: yield = 0.0_wp        !! sigma_0 of all but Swift [stress]
    real(wp) :: modulus = 0.0_wp      !! slope of linear hardening [stress]
    real(wp) :: saturation = 0.0_wp   !! Q of Voce, sigma_s - sigma_0 of Hockett and Sherby [stress]
    real(wp) :: rate = 0.0_wp         !! b of Voce, m of Hockett and Sherby
    real(wp) :: strength = 0.0_wp     !! K of Swift and Ludwik [stress]
    real(wp) :: offset = 0.0_wp       !! eps_0 of Swift
    real(wp) :: exponent = 0.0_wp     !! n of Swift, Ludwik, Hockett and Sherby
    real(wp) :: fraction = 0.0_wp     !! alpha, fraction of Swift in the mix
    real(wp), allocatable :: strains(:), stresses(:)   !! points of the table
    real(wp), allocatable :: slopes(:)                 !! after each of them, the last is zero
    !> Last point of the table at or before the start of each of many equal parts of its strains.
    integer, allocatable :: place_of(:)
    real(wp) :: parts_per_strain = 0.0_wp
  end type hardening_t

  ! Bounds of the strain of a power and of one over it, so that flow, slope and bend stay numbers.
  real(wp), parameter :: least_strain = 1.0e-200_wp, most_per_strain = 1.0e50_wp

  character(*), parameter :: softening = &
    "the flow stress would fall: softening localizes in one element, whatever its size"

contains

  !> Curve of this name with its constants checked: VOCE (sigma_0, Q, b), SWIFT (K, eps_0, n),
  !! LUDWIK (sigma_0, K, n), LINEAR (sigma_0, H), PERFECT (sigma_0), VOCE SWIFT (alpha, K, eps_0, n,
  !! sigma_0, Q, b), HOCKETT SHERBY (sigma_0, sigma_s, m, n) or TABLE (stress, plastic strain,
  !! stress, ...). Softening is rejected.
  pure subroutine new_hardening(name, constants, curve, error)
    character(*), intent(in) :: name
    real(wp), intent(in) :: constants(:)
    type(hardening_t), intent(out) :: curve
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: names(7) = [character(14) :: "VOCE", "SWIFT", "LUDWIK", "LINEAR", &
      "PERFECT", "VOCE SWIFT", "HOCKETT SHERBY"]
    integer, parameter :: kinds(7) = [voce_kind, swift_kind, ludwik_kind, linear_kind, &
      linear_kind, mixed_kind, hockett_kind]
    integer, parameter :: counts(7) = [3, 3, 3, 2, 1, 7, 4]
    character(*), parameter :: words(7) = [character(50) :: "three constants: sigma_0, Q, b", &
      "three constants: K, eps_0, n", "three constants: sigma_0, K, n", &
      "two constants: sigma_0, H", "one constant: sigma_0", &
      "seven constants: alpha, K, eps_0, n, sigma_0, Q, b", &
      "four constants: sigma_0, sigma_s, m, n"]
    integer :: i

    call check_finite("constants", constants, error)
    if (allocated(error)) return
    if (name == "TABLE") then
      call set_table(constants, curve, error)
      return
    end if
    do i = 1, size(names)
      if (names(i) == name) exit
    end do
    if (i > size(names)) then
      call fail(error, "material: unknown hardening "//trim(name)//", known are VOCE, SWIFT, "// &
                "LUDWIK, LINEAR, PERFECT, VOCE SWIFT, HOCKETT SHERBY and TABLE")
      return
    end if
    curve%kind = kinds(i)
    call check_count("the hardening "//name, constants, counts(i), trim(words(i)), error)
    if (.not. allocated(error)) call set_constants(constants, curve, error)
  end subroutine new_hardening

  !> Put the constants of a formula in their places and check them.
  pure subroutine set_constants(constants, curve, error)
    real(wp), intent(in) :: constants(:)
    type(hardening_t), intent(inout) :: curve
    type(error_t), allocatable, intent(inout) :: error
    integer :: n, first

    n = size(constants)
    if (curve%kind == mixed_kind) then
      curve%fraction = constants(1)
      call require(curve%fraction >= 0.0_wp .and. curve%fraction <= 1.0_wp, &
                   "material: the fraction alpha of Swift must lie between 0 and 1", error)
    end if
    if (has_power(curve)) then
      first = merge(2, 1, curve%kind /= swift_kind)
      curve%strength = constants(first)
      if (curve%kind /= ludwik_kind) curve%offset = constants(first + 1)
      curve%exponent = constants(merge(4, 3, curve%kind == mixed_kind))
      call require(curve%strength > 0.0_wp, "material: the strength K must be positive", error)
      call require(curve%offset >= 0.0_wp, "material: the strain eps_0 must not be negative", error)
      call require(curve%exponent >= 0.0_wp, &
                   "material: the exponent n must not be negative, "//softening, error)
      call require(curve%exponent <= 1.0_wp, "material: the exponent n must not exceed 1", error)
    end if
    select case (curve%kind)
    case (swift_kind)
      return
    case (hockett_kind)
      call set_hockett(constants, curve, error)
    case (ludwik_kind, linear_kind)
      curve%yield = constants(1)
      if (curve%kind == linear_kind .and. n == 2) curve%modulus = constants(2)
    case default
      curve%yield = constants(n - 2)
      curve%saturation = constants(n - 1)
      curve%rate = constants(n)
    end select
    call require(curve%yield > 0.0_wp, &
                 "material: the yield stress sigma_0 must be positive", error)
    call require(curve%modulus >= 0.0_wp, &
                 "material: the modulus H must not be negative, "//softening, error)
    call require(curve%saturation >= 0.0_wp, &
                 "material: the hardening Q must not be negative, "//softening, error)
    call require(curve%rate >= 0.0_wp, &
                 "material: the saturation rate b must not be negative, "//softening, error)
  end subroutine set_constants

  pure subroutine set_hockett(constants, curve, error)
    real(wp), intent(in) :: constants(:)   !! sigma_0, sigma_s, m, n
    type(hardening_t), intent(inout) :: curve
    type(error_t), allocatable, intent(inout) :: error

    curve%yield = constants(1)
    curve%saturation = constants(2) - constants(1)
    curve%rate = constants(3)
    curve%exponent = constants(4)
    call require(curve%saturation >= 0.0_wp, &
                 "material: sigma_s must not be below sigma_0, "//softening, error)
    call require(curve%rate >= 0.0_wp, "material: m must not be negative, "//softening, error)
    call require(curve%exponent > 0.0_wp .and. curve%exponent <= 1.0_wp, &
                 "material: the exponent n must be above 0 and not exceed 1", error)
  end subroutine set_hockett

  pure subroutine set_table(constants, curve, error)
    real(wp), intent(in) :: constants(:)   !! stress and plastic strain in turn
    type(hardening_t), intent(inout) :: curve
    type(error_t), allocatable, intent(out) :: error
    integer :: n

    curve%kind = table_kind
    n = size(constants)/2
    curve%stresses = constants(1::2)
    curve%strains = constants(2::2)
    call require(n > 0 .and. size(constants) == 2*n, &
                 "material: a table of hardening takes pairs of stress and plastic strain", error)
    if (allocated(error)) return
    call require(abs(curve%strains(1)) <= 0.0_wp, &
                 "material: a table of hardening begins at plastic strain 0", error)
    call require(all(curve%strains(2:) > curve%strains(:n - 1)), &
                 "material: the plastic strains of a table of hardening must rise", error)
    call require(curve%stresses(1) > 0.0_wp, &
                 "material: the yield stress of a table of hardening must be positive", error)
    call require(all(curve%stresses(2:) >= curve%stresses(:n - 1)), &
                 "material: the stresses of a table of hardening must not fall, "//softening, error)
    if (.not. allocated(error)) call prepare_table(n, curve)
  end subroutine set_table

  !> Slopes of a table and where to look in it for a strain.
  pure subroutine prepare_table(n, curve)
    integer, intent(in) :: n                        !! points of the table
    type(hardening_t), intent(inout) :: curve
    integer, parameter :: parts_per_point = 4
    integer :: i, place

    allocate (curve%slopes(n), source=0.0_wp)
    curve%slopes(:n - 1) = (curve%stresses(2:) - curve%stresses(:n - 1)) &
                           /(curve%strains(2:) - curve%strains(:n - 1))
    allocate (curve%place_of(0:parts_per_point*n), source=n)
    if (n > 1) curve%parts_per_strain = parts_per_point*n/curve%strains(n)
    place = 1
    do i = 0, parts_per_point*n - 1
      do while (place < n)
        if (curve%strains(place + 1)*curve%parts_per_strain > i) exit
        place = place + 1
      end do
      curve%place_of(i) = place
    end do
  end subroutine prepare_table

  !> Does a power of the strain belong to the curve?
  elemental logical function has_power(curve)
    type(hardening_t), intent(in) :: curve

    has_power = curve%kind == swift_kind .or. curve%kind == ludwik_kind &
                .or. curve%kind == mixed_kind
  end function has_power

  !> Is the slope infinite at zero plastic strain, as that of Hollomon's curve is?
  elemental logical function is_steep_at_start(curve)
    type(hardening_t), intent(in) :: curve

    is_steep_at_start = (has_power(curve) .or. curve%kind == hockett_kind) &
                        .and. curve%offset <= 0.0_wp .and. curve%exponent < 1.0_wp
  end function is_steep_at_start

  !> Flow stress, its slope and its bend at the plastic strains of a row. Where the slope is
  !! infinite it comes back as a very large number.
  pure subroutine harden(curve, n, eqps, flow, slope, bend, reach)
    type(hardening_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(out) :: flow(n), slope(n)   !! [stress]
    real(wp), intent(out) :: bend(n)             !! by which the slope falls with the strain
    real(wp), intent(out) :: reach(n)            !! further strain up to which all this holds, huge
                                                 !! for a curve without corners
    real(wp), dimension(n) :: other, other_slope, other_bend

    reach = huge(reach)
    select case (curve%kind)
    case (voce_kind)
      call voce_row(curve, n, eqps, flow, slope, bend)
    case (swift_kind, ludwik_kind)
      call power_law_row(curve, n, eqps, flow, slope, bend)
      flow = curve%yield + flow
    case (mixed_kind)
      call power_law_row(curve, n, eqps, flow, slope, bend)
      call voce_row(curve, n, eqps, other, other_slope, other_bend)
      flow = curve%fraction*flow + (1.0_wp - curve%fraction)*other
      slope = curve%fraction*slope + (1.0_wp - curve%fraction)*other_slope
      bend = curve%fraction*bend + (1.0_wp - curve%fraction)*other_bend
    case (hockett_kind)
      call hockett_row(curve, n, eqps, flow, slope, bend)
    case (table_kind)
      call table_row(curve, n, eqps, flow, slope, reach)
      bend = 0.0_wp
    case default
      flow = curve%yield + curve%modulus*eqps
      slope = curve%modulus
      bend = 0.0_wp
    end select
  end subroutine harden

  !> `harden` at eqps + deqps from the flow stress `first` at eqps: of a power by a short series
  !! where all increments of the row are short.
  pure subroutine harden_after(curve, n, eqps, first, deqps, flow, slope, bend, reach)
    type(hardening_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in), dimension(n) :: eqps, first, deqps   !! no deqps is negative
    real(wp), intent(out), dimension(n) :: flow, slope, bend, reach   !! see `harden`
    real(wp), parameter :: least = 1.0e-12_wp   ! strain with a series: below, `first` has lost its
                                                ! power
    real(wp) :: per_strain(n), rest, most
    integer :: l

    most = 0.0_wp
    select case (curve%kind)
    case (voce_kind)
      !$omp simd reduction(max: most)
      do l = 1, n
        most = max(most, deqps(l))
      end do
      reach = huge(reach)
      call exp_multiple(n, -curve%rate, most, deqps, flow)
      !$omp simd private(rest)
      do l = 1, n
        rest = max(curve%yield + curve%saturation - first(l), 0.0_wp)*flow(l)
        slope(l) = curve%rate*rest
        bend(l) = curve%rate*slope(l)
        flow(l) = curve%yield + curve%saturation - rest
      end do
      return
    case (swift_kind, ludwik_kind)
      ! Counted, for a largest value would pass over what is not a number.
      !$omp simd reduction(+: most)
      do l = 1, n
        per_strain(l) = curve%offset + eqps(l)
        most = most + merge(0.0_wp, 1.0_wp, deqps(l) <= small_part*per_strain(l) &
                                            .and. per_strain(l) >= least)
      end do
      if (most <= 0.0_wp) then
        reach = huge(reach)
        !$omp simd
        do l = 1, n
          per_strain(l) = 1.0_wp/per_strain(l)
          flow(l) = deqps(l)*per_strain(l)
          slope(l) = flow(l)
        end do
        call power_small(n, curve%exponent, flow)
        call power_small(n, -1.0_wp, slope)
        !$omp simd
        do l = 1, n
          per_strain(l) = per_strain(l)*slope(l)
          flow(l) = (first(l) - curve%yield)*flow(l)
          slope(l) = curve%exponent*flow(l)*per_strain(l)
          bend(l) = (1.0_wp - curve%exponent)*slope(l)*min(per_strain(l), most_per_strain)
          flow(l) = curve%yield + flow(l)
        end do
        return
      end if
    end select
    call harden(curve, n, eqps + deqps, flow, slope, bend, reach)
  end subroutine harden_after

  pure subroutine voce_row(curve, n, eqps, flow, slope, bend)
    type(hardening_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(out) :: flow(n), slope(n), bend(n)
    integer :: l

    call exp_row(n, -curve%rate, eqps, flow)
    !$omp simd
    do l = 1, n
      slope(l) = curve%saturation*curve%rate*flow(l)
      bend(l) = curve%rate*slope(l)
      flow(l) = curve%yield + curve%saturation*(1.0_wp - flow(l))
    end do
  end subroutine voce_row

  !> K (eps_0 + eqps)^n.
  pure subroutine power_law_row(curve, n, eqps, flow, slope, bend)
    type(hardening_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(out) :: flow(n), slope(n), bend(n)
    real(wp) :: strain(n)
    integer :: l

    strain = curve%offset + eqps
    strain = merge(least_strain, strain, strain < least_strain)   ! a NaN stays a NaN
    flow = strain
    call power_row(n, curve%exponent, flow)
    !$omp simd
    do l = 1, n
      strain(l) = 1.0_wp/strain(l)
      flow(l) = curve%strength*flow(l)
      slope(l) = curve%exponent*flow(l)*strain(l)
      bend(l) = (1.0_wp - curve%exponent)*slope(l)*min(strain(l), most_per_strain)
    end do
  end subroutine power_law_row

  !> sigma_s - (sigma_s - sigma_0) exp(-m eqps^n).
  pure subroutine hockett_row(curve, n, eqps, flow, slope, bend)
    type(hardening_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(out) :: flow(n), slope(n), bend(n)
    real(wp) :: strain(n), power(n)
    integer :: l

    strain = merge(least_strain, eqps, eqps < least_strain)   ! a NaN stays a NaN
    power = strain
    call power_row(n, curve%exponent, power)
    call exp_row(n, -curve%rate, power, flow)
    !$omp simd
    do l = 1, n
      strain(l) = 1.0_wp/strain(l)
      ! The slope of m eqps^n.
      power(l) = curve%rate*curve%exponent*power(l)*strain(l)
      slope(l) = curve%saturation*power(l)*flow(l)
      bend(l) = slope(l)*min((1.0_wp - curve%exponent)*strain(l) + power(l), most_per_strain)
      flow(l) = curve%yield + curve%saturation*(1.0_wp - flow(l))
    end do
  end subroutine hockett_row

  !> Linear between the points of the table, constant after the last.
  pure subroutine table_row(curve, n, eqps, flow, slope, reach)
    type(hardening_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(out) :: flow(n), slope(n), reach(n)
    real(wp), parameter :: far = 0.5_wp*huge(far)
    integer :: l, place, last

    last = size(curve%strains)
    do l = 1, n
      place = curve%place_of(int(max(0.0_wp, min(eqps(l)*curve%parts_per_strain, &
                                                 real(ubound(curve%place_of, 1), wp)))))
      reach(l) = far
      do while (place < last)
        reach(l) = curve%strains(place + 1) - eqps(l)
        if (reach(l) > 0.0_wp) exit
        place = place + 1
        reach(l) = far
      end do
      slope(l) = curve%slopes(place)
      flow(l) = curve%stresses(place) + slope(l)*(eqps(l) - curve%strains(place))
    end do
  end subroutine table_row

  !> From pairs of C > 0 and gamma >= 0.
  pure subroutine new_back_stresses(pairs, back, error)
    real(wp), intent(in) :: pairs(:)
    type(back_stresses_t), intent(out) :: back
    type(error_t), allocatable, intent(out) :: error

    call require(size(pairs) > 0 .and. mod(size(pairs), 2) == 0, &
                 "material: back stresses take pairs of C and gamma", error)
    call check_finite("constants of back stresses", pairs, error)
    call require(all(pairs(1::2) > 0.0_wp), &
                 "material: the modulus C of a back stress must be positive", error)
    call require(all(pairs(2::2) >= 0.0_wp), &
                 "material: the recall gamma of a back stress must not be negative", error)
    back%n = size(pairs)/2
    back%modulus = pairs(1::2)
    back%recall = pairs(2::2)
  end subroutine new_back_stresses

  !> Why the shear stress of a law with these back stresses is wrong in large simple shear; empty
  !! without back stresses. In simple shear that lasts, a back stress keeps 1/(1 + 3/gamma^2) of its
  !! shear.
  pure function back_stress_warning(back) result(warning)
    type(back_stresses_t), intent(in) :: back
    character(:), allocatable :: warning
    real(wp) :: least

    warning = ""
    if (back%n == 0) return
    least = minval(back%recall)
    warning = "back stresses rotate with the spin (Jaumann rate), so the shear stress is too "// &
              "low and may fall: of a back stress with gamma "//rounded_text(least)// &
              " continued simple shear leaves "// &
              to_text(nint(100*least**2/(least**2 + 3.0_wp)))//" %"
  end function back_stress_warning

end module hardening
