!> Yield functions of sheet metal that are defined in plane stress, from the constants of a deck.
!!
!! BARLAT89: F. Barlat and J. Lian, Int. J. Plasticity 5 (1989), eqs. (8) and (10).
!! YLD2000: Yld2000-2d, F. Barlat et al., Int. J. Plasticity 19 (2003).
!! BBC2003: D. Banabic, H. Aretz, D. S. Comsa and L. Paraianu, Int. J. Plasticity 21 (2005), eqs.
!! (9) and (10). BBC2005: the later form by the same authors, as the subroutines UMMDp of JANCAE
!! define it. Axis 1 is the rolling direction.
module sheet_functions
  use kinds, only: wp
  use failure, only: error_t
  use text, only: to_text, rounded_text
  use constant_check, only: check_finite, check_count, require
  use plane_yield, only: plane_yield_t, new_plane_yield, most_half
  implicit none
  private

  public :: is_sheet_function, is_for_sheets_alone, new_sheet_function, isotropic_shears, &
            barlat89_of_r_values

  character(*), parameter :: names(4) = [character(8) :: "BARLAT89", "BBC2003", "BBC2005", &
                                         "YLD2000"]

contains

  !> Is it the name of a function for plane stress?
  pure logical function is_sheet_function(name)
    character(*), intent(in) :: name

    is_sheet_function = any(names == name)
  end function is_sheet_function

  !> One that has no form for solids?
  pure logical function is_for_sheets_alone(name)
    character(*), intent(in) :: name

    is_for_sheets_alone = any(names(:3) == name)
  end function is_for_sheets_alone

  !> Factors of s12^2 in the squares of YLD2000 for a sheet that bears all shears alike.
  pure function isotropic_shears(half) result(shears)
    integer, intent(in) :: half              !! of the exponent
    real(wp) :: shears(3)

    shears = [0.0_wp, 1.0_wp, (2.0_wp*0.5_wp**(0.5_wp/half))**2]
  end function isotropic_shears

  !> Function of this name: BARLAT89 (r_0, r_45, r_90, m or a, c, h, p, m), YLD2000 (alpha_1 to
  !! alpha_8, m), BBC2003 (a, M, N, P, Q, R, S, T, k) or BBC2005 (a, b, L, M, N, P, Q, R, k).
  pure subroutine new_sheet_function(name, constants, yield, error)
    character(*), intent(in) :: name              !! for which `is_sheet_function` is true
    real(wp), intent(in) :: constants(:)
    type(plane_yield_t), intent(out) :: yield
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: c(8)
    integer :: n, half

    call check_finite("constants of the yield function", constants, error)
    n = size(constants)
    if (name == "BARLAT89") then
      call require(n == 4 .or. n == 5, "material: the yield function BARLAT89 takes r_0, r_45, "// &
                   "r_90 and the exponent m, or a, c, h, p and m, not "//to_text(n)// &
                   " numbers", error)
    else if (name == "YLD2000") then
      call check_count("the yield function "//name, constants, 9, &
                       "alpha_1 to alpha_8 and the exponent m, not "//to_text(n)//" numbers", error)
    else
      call check_count("the yield function "//name, constants, 9, &
                       "eight coefficients and k, not "//to_text(n)//" numbers", error)
    end if
    if (allocated(error)) return
    c(:n - 1) = constants(:n - 1)
    call find_half(name, constants(n), half, error)
    select case (name)
    case ("BARLAT89")
      if (n == 4) then
        call require(all(c(:3) > 0.0_wp), "material: the r-values must be positive", error)
        if (.not. allocated(error)) c(:4) = barlat89_of_r_values(c(:3), 2*half)
      end if
      call require(c(1) > 0.0_wp .and. c(2) >= 0.0_wp .and. all(c(3:4) > 0.0_wp), &
                   "material: a, h and p must be positive and c must not be negative, or the "// &
                   "yield surface is not convex", error)
    case ("BBC2003")
      call require(c(1) > 0.0_wp .and. c(1) <= 1.0_wp, "material: a must lie above 0 and "// &
                   "not above 1, or the yield surface is not convex", error)
    case ("BBC2005")
      call require(c(1) > 0.0_wp .and. c(2) >= 0.0_wp, "material: a must be positive and "// &
                   "b must not be negative, or the yield surface is not convex", error)
    end select
    if (allocated(error)) return
    yield = function_of(name, c, half)
    call require(is_bounded(yield), "material: with these coefficients stresses in some "// &
                 "direction never yield", error)
  end subroutine new_sheet_function

  !> Half of the exponent: the last number is m, or k = m/2 for the functions of Banabic.
  pure subroutine find_half(name, number, half, error)
    character(*), intent(in) :: name
    real(wp), intent(in) :: number
    integer, intent(out) :: half
    type(error_t), allocatable, intent(inout) :: error
    integer :: factor
    character(:), allocatable :: wanted

    if (name(:3) == "BBC") then
      factor = 1
      wanted = "k must be a whole number from 1 to 50"
    else
      factor = 2
      wanted = "the exponent m must be an even whole number from 2 to 100"
    end if
    half = 1
    if (number >= factor .and. number <= factor*most_half) half = nint(number/factor)
    call require(abs(number - factor*half) <= 0.0_wp, &
                 "material: "//wanted//", not "//rounded_text(number), error)
  end subroutine find_half

  !> The function by its squares of stresses, see `plane_yield`.
  pure function function_of(name, c, half) result(yield)
    character(*), intent(in) :: name
    real(wp), intent(in) :: c(:)
    integer, intent(in) :: half
    type(plane_yield_t) :: yield
    real(wp) :: normal(2, 5), shear(5), per, first, second

    per = 1.0_wp/(2*half)
    normal = 0.0_wp
    shear = 0.0_wp
    select case (name)
    case ("BARLAT89")
      ! a e(K1, K2) + c/2 (2 K2)^m.
      first = c(1)**per
      second = 2.0_wp*(0.5_wp*c(2))**per
      normal(:, 1) = first*0.5_wp*[1.0_wp, c(3)]
      normal(:, 2) = first*0.5_wp*[1.0_wp, -c(3)]
      normal(:, 3) = second*0.5_wp*[1.0_wp, -c(3)]
      shear(2:3) = ([first, second]*c(4))**2
    case ("YLD2000")
      ! e of 3/2 of the trace of X'' and half the difference of its principal values, and half of
      ! the power of the difference of those of X'.
      second = 2.0_wp*0.5_wp**per
      normal(:, 1) = [2.0_wp*c(3) - 2.0_wp*c(4) + 4.0_wp*c(5) - c(6), &
                      -c(3) + 4.0_wp*c(4) - 2.0_wp*c(5) + 2.0_wp*c(6)]/6.0_wp
      normal(:, 2) = [-6.0_wp*c(3) + 6.0_wp*c(4) + 12.0_wp*c(5) - 3.0_wp*c(6), &
                      3.0_wp*c(3) - 12.0_wp*c(4) - 6.0_wp*c(5) + 6.0_wp*c(6)]/18.0_wp
      normal(:, 3) = second*[2.0_wp*c(1) + c(2), -c(1) - 2.0_wp*c(2)]/6.0_wp
      shear(2:3) = [c(8), second*c(7)]**2
    case ("BBC2003")
      first = (2.0_wp*c(1))**per
      second = 2.0_wp*(1.0_wp - c(1))**per
      normal(:, 1) = first*0.5_wp*[1.0_wp, c(2)]
      normal(:, 2) = first*0.5_wp*[c(3), -c(4)]
      normal(:, 3) = second*0.5_wp*[c(6), -c(7)]
      shear(2:3) = [first*c(5), second*c(8)]**2
    case default
      first = (2.0_wp*c(1))**per
      second = (2.0_wp*c(2))**per
      normal(:, 1) = first*c(3:4)
      normal(:, 2) = first*[c(5), -c(6)]
      normal(:, 4) = second*[c(5), -c(6)]
      normal(:, 5) = second*[c(7), -c(8)]
      shear([2, 4, 5]) = [first, second, second]**2
    end select
    yield = new_plane_yield(half, normal, shear)
  end function function_of

  !> Do all stresses yield when they grow?
  pure logical function is_bounded(yield)
    type(plane_yield_t), intent(in) :: yield
    real(wp), parameter :: least = 1.0e-8_wp
    real(wp) :: sums(2, 2), total

    sums = matmul(yield%normal, transpose(yield%normal))
    total = sums(1, 1) + sums(2, 2)
    is_bounded = sums(1, 1)*sums(2, 2) - sums(1, 2)**2 > (least*total)**2 &
                 .and. sum(yield%shear) > least**2*total .and. total > 0.0_wp
  end function is_bounded

  !> a, c, h and p of Barlat and Lian from three r-values. The last is found by halving: the r-value
  !! at 45 degrees rises with it, from -1/2 to any value.
  pure function barlat89_of_r_values(r, m) result(c)
    real(wp), intent(in) :: r(3)          !! along 0, 45 and 90 degrees from rolling, positive
    integer, intent(in) :: m              !! exponent
    real(wp) :: c(4)
    real(wp), parameter :: far = 1.0e4_wp
    real(wp) :: low, high, middle
    integer :: i

    c(2) = 2.0_wp*sqrt(r(1)/(1.0_wp + r(1))*(r(3)/(1.0_wp + r(3))))
    c(1) = 2.0_wp - c(2)
    c(3) = sqrt(r(1)/(1.0_wp + r(1))*((1.0_wp + r(3))/r(3)))
    low = 1.0_wp/far
    high = far
    do i = 1, 200
      middle = sqrt(low*high)
      if (r_45(c(:3), middle, m) > r(2)) then
        high = middle
      else
        low = middle
      end if
      if (high - low <= epsilon(high)*high) exit
    end do
    c(4) = sqrt(low*high)
  end function barlat89_of_r_values

  !> r-value at 45 degrees of a, c, h and p: half of the slope with the shear over that with the
  !! trace, less 1/2. Lengths are over that of K1 + K2, so that no power is too large.
  pure real(wp) function r_45(c, p, m)
    real(wp), intent(in) :: c(3), p
    integer, intent(in) :: m
    real(wp) :: k1, k2, sum_power, difference_power, by_k1, by_k2, length

    k1 = 0.25_wp*(1.0_wp + c(3))
    k2 = sqrt(0.0625_wp*(1.0_wp - c(3))**2 + 0.25_wp*p**2)
    length = k1 + k2
    sum_power = 1.0_wp
    difference_power = ((k1 - k2)/length)**(m - 1)
    by_k1 = 0.5_wp*c(1)*(sum_power + difference_power)
    by_k2 = 0.5_wp*c(1)*(sum_power - difference_power) + c(2)*(2.0_wp*k2/length)**(m - 1)
    r_45 = 0.5_wp*(0.5_wp*p**2*by_k2/k2) &
           /(by_k1*0.5_wp*(1.0_wp + c(3)) + by_k2*0.125_wp*(1.0_wp - c(3))**2/k2) - 0.5_wp
  end function r_45

end module sheet_functions
