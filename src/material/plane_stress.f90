!> Plane stress in the frame of the sheet: elastic trial and plastic flow of a row of points, and
!! the search for the strain through the thickness that leaves no stress 33.
!!
!! Stress is used as the modes (s11 + s22)/2, sqrt 3 (s11 - s22)/2 and sqrt 3 s12, which isotropic
!! elasticity keeps apart and whose squares add up to that of the von Mises stress (J. C. Simo and
!! R. L. Taylor, IJNME 22 (1986)). Plastic flow keeps the volume, so the strain 33 follows from the
!! strains in the plane and the change of the mean stress.
module plane_stress
  use kinds, only: wp
  implicit none
  private

  public :: areal_modulus, thinning_ratio
  public :: plane_trial, flow_in_plane, mode_moduli, plane_work, in_space, &
            begin_search, advance_search, is_as_good

  integer, parameter, public :: in_sheet(3) = [1, 2, 4]  !! of the components 11 22 33 12 13 23

  integer, parameter, public :: max_trials = 100    !! of `advance_search`, which then has halved

  !> Of the largest stress of the trial and the shear modulus times the largest strain increment.
  real(wp), parameter :: tolerance = 1.0e-10_wp
  real(wp), parameter :: root3 = sqrt(3.0_wp)
  real(wp), parameter :: any_strain = 1.0e30_wp     ! no bound of the bracket yet

contains

  !> Mean stress over the strain of the area, E/(2 (1 - nu)).
  elemental real(wp) function areal_modulus(bulk, shear)
    real(wp), intent(in) :: bulk, shear

    areal_modulus = 9.0_wp*bulk*shear/(3.0_wp*bulk + 4.0_wp*shear)
  end function areal_modulus

  !> Elastic strain through the thickness over the strain of the area, -nu/(1 - nu).
  elemental real(wp) function thinning_ratio(bulk, shear)
    real(wp), intent(in) :: bulk, shear

    thinning_ratio = -(3.0_wp*bulk - 2.0_wp*shear)/(3.0_wp*bulk + 4.0_wp*shear)
  end function thinning_ratio

  !> Elastic moduli of the modes, of which the first is the smallest.
  pure function mode_moduli(bulk, shear) result(moduli)
    real(wp), intent(in) :: bulk, shear
    real(wp) :: moduli(3)

    moduli = [areal_modulus(bulk, shear), 3.0_wp*shear, 3.0_wp*shear]
  end function mode_moduli

  !> Elastic trial of a row, and the largest square of its von Mises stresses (huge where not a
  !! number). No strain changes no bit.
  pure subroutine plane_trial(n, bulk, shear, dstrain, stress, through, modes, worst)
    integer, intent(in) :: n
    real(wp), intent(in) :: bulk, shear
    real(wp), intent(in) :: dstrain(n, 3)      !! 11 22 12, engineering shear
    real(wp), intent(inout) :: stress(n, 3)    !! 11 22 12
    real(wp), intent(out) :: through(n)        !! strain increment 33
    real(wp), intent(out) :: modes(n, 3)
    real(wp), intent(out) :: worst
    real(wp) :: areal, thinning, mean, half, s1, s2, s3, square, total
    integer :: l

    areal = areal_modulus(bulk, shear)
    thinning = thinning_ratio(bulk, shear)
    worst = 0.0_wp
    total = 0.0_wp
    !$omp simd private(mean, half, s1, s2, s3, square) reduction(max:worst) reduction(+:total)
    do l = 1, n
      mean = dstrain(l, 1) + dstrain(l, 2)
      half = shear*(dstrain(l, 1) - dstrain(l, 2))
      through(l) = thinning*mean
      mean = areal*mean
      s1 = stress(l, 1) + (mean + half)
      s2 = stress(l, 2) + (mean - half)
      s3 = stress(l, 3) + shear*dstrain(l, 3)
      stress(l, 1) = s1
      stress(l, 2) = s2
      stress(l, 3) = s3
      mean = 0.5_wp*(s1 + s2)
      half = (0.5_wp*root3)*(s1 - s2)
      s3 = root3*s3
      modes(l, 1) = mean
      modes(l, 2) = half
      modes(l, 3) = s3
      square = mean*mean + half*half + s3*s3
      worst = max(worst, square)
      total = total + square
    end do
    ! max() may drop a NaN, a sum cannot.
    if (.not. total <= huge(total)) worst = huge(worst)
  end subroutine plane_trial

  !> Let a row flow after its elastic trial. What does not flow keeps its bits.
  pure subroutine flow_in_plane(n, bulk, shear, plastic, stress, through)
    integer, intent(in) :: n
    real(wp), intent(in) :: bulk, shear
    real(wp), intent(in) :: plastic(n, 3)      !! strain: 11 + 22, 11 - 22 and shear 12 over sqrt 3
    real(wp), intent(inout) :: stress(n, 3), through(n)
    real(wp) :: areal, thinning, mean, half
    integer :: l

    areal = areal_modulus(bulk, shear)
    thinning = areal/(1.5_wp*bulk)
    !$omp simd private(mean, half)
    do l = 1, n
      mean = areal*plastic(l, 1)
      half = root3*shear*plastic(l, 2)
      stress(l, 1) = stress(l, 1) - (mean + half)
      stress(l, 2) = stress(l, 2) - (mean - half)
      stress(l, 3) = stress(l, 3) - root3*shear*plastic(l, 3)
      through(l) = through(l) - thinning*plastic(l, 1)
    end do
  end subroutine flow_in_plane

  !> Work per volume of the stress on the plastic strain.
  pure function plane_work(n, stress, plastic) result(work)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 3), plastic(n, 3)   !! as in `flow_in_plane`
    real(wp) :: work(n)
    integer :: l

    !$omp simd
    do l = 1, n
      work(l) = 0.5_wp*((stress(l, 1) + stress(l, 2))*plastic(l, 1) &
                        + root3*(stress(l, 1) - stress(l, 2))*plastic(l, 2)) &
                + root3*stress(l, 3)*plastic(l, 3)
    end do
  end function plane_work

  !> Strain increments 11 22 12 with the others that keep the volume: 11 22 33 12 13 23.
  pure function in_space(n, dstrain) result(strain)
    integer, intent(in) :: n
    real(wp), intent(in) :: dstrain(n, 3)
    real(wp) :: strain(n, 6)

    strain = 0.0_wp
    strain(:, :2) = dstrain(:, :2)
    strain(:, 3) = -(dstrain(:, 1) + dstrain(:, 2))
    strain(:, 4) = dstrain(:, 3)
  end function in_space

  !> Where the search for the strain 33 begins: at that of the increment before if the area changes
  !! as it did then, else at the elastic one.
  pure subroutine begin_search(n, bulk, shear, strain, search)
    integer, intent(in) :: n
    real(wp), intent(in) :: bulk, shear
    real(wp), intent(inout) :: strain(n, 6)    !! 11 22 33 12 13 23, 33: of the increment before
    real(wp), intent(out) :: search(n, 4)      !! bracket, last strain and last stress 33
    real(wp) :: area, elastic, thinning
    integer :: l

    thinning = thinning_ratio(bulk, shear)
    !$omp simd private(area, elastic)
    do l = 1, n
      area = strain(l, 1) + strain(l, 2)
      elastic = thinning*area
      if (strain(l, 3)*area >= 0.0_wp .or. abs(strain(l, 3)) > 2.0_wp*abs(area)) &
        strain(l, 3) = elastic
      search(l, 1) = -any_strain
      search(l, 2) = any_strain
      search(l, 3) = 0.0_wp
      search(l, 4) = 0.0_wp
    end do
  end subroutine begin_search

  !> One step towards stress 33 = 0 of points whose stress rises with the strain 33. Found points
  !! keep their strain. The first slope is that of flow along the plastic strain of the trial, later
  !! ones are secants; a step that leaves the bracket is halved.
  pure subroutine advance_search(n, iteration, bulk, shear, noise, before, tried, strain, search, &
                                 is_done)
    integer, intent(in) :: n, iteration        !! of the steps, from 1
    real(wp), intent(in) :: bulk, shear
    real(wp), intent(in) :: noise              !! stress 33 that counts as none
    real(wp), intent(in), dimension(n, 6) :: before, tried     !! stress, after `strain` as well
    real(wp), intent(inout) :: strain(n, 6), search(n, 4)
    logical, intent(out) :: is_done            !! at all points
    integer, parameter :: most_secants = 20
    real(wp) :: slope(n), stiff, now, next, residual, scaling, n_open, is_open, run
    integer :: l

    stiff = bulk + 4.0_wp/3.0_wp*shear
    if (iteration == 1) call first_slope(n, bulk, shear, before, tried, strain, slope)
    n_open = 0.0_wp
    !$omp simd private(now, next, residual, scaling, is_open, run) reduction(+:n_open)
    do l = 1, n
      now = strain(l, 3)
      residual = tried(l, 3)
      run = now - search(l, 3)
      if (iteration > 1) then
        slope(l) = stiff
        if (abs(run) > 0.0_wp) slope(l) = (residual - search(l, 4))/run
        slope(l) = max(0.5_wp*bulk, min(slope(l), 2.0_wp*stiff))
      end if
      if (residual < 0.0_wp) search(l, 1) = now
      if (residual > 0.0_wp) search(l, 2) = now
      next = now - residual/slope(l)
      if (next <= search(l, 1) .or. next >= search(l, 2) .or. &
          (iteration > most_secants .and. search(l, 2) - search(l, 1) < any_strain)) &
        next = 0.5_wp*(search(l, 1) + search(l, 2))
      scaling = max(abs(tried(l, 1)), abs(tried(l, 2)), abs(tried(l, 4))) &
                + shear*max(abs(strain(l, 1)), abs(strain(l, 2)), abs(strain(l, 4)))
      ! Counted, for a largest value would pass over what is not a number.
      is_open = 1.0_wp
      if (abs(residual) <= tolerance*scaling + noise) is_open = 0.0_wp
      n_open = n_open + is_open
      search(l, 3) = now
      search(l, 4) = residual
      if (is_open > 0.0_wp) strain(l, 3) = next
    end do
    is_done = n_open <= 0.0_wp
  end subroutine advance_search

  !> Is a search over that could not go on, with a stress 33 that is small at all points?
  pure logical function is_as_good(n, shear, tried, strain, search)
    integer, intent(in) :: n
    real(wp), intent(in) :: shear
    real(wp), intent(in), dimension(n, 6) :: tried, strain
    real(wp), intent(in) :: search(n, 4)
    real(wp), parameter :: loose = 1.0e-6_wp
    real(wp) :: scaling(n)

    scaling = maxval(abs(tried(:, in_sheet)), 2) + shear*maxval(abs(strain(:, in_sheet)), 2)
    is_as_good = all(abs(search(:, 4)) <= loose*scaling)
  end function is_as_good

  !> Slope of the stress 33 against the strain 33 of points that flow along their plastic strain,
  !! without hardening, as J2 flow has it (J. C. Simo and T. J. R. Hughes, Computational
  !! Inelasticity, Springer 1998, box 3.2). Where nothing has flowed it is the elastic one.
  pure subroutine first_slope(n, bulk, shear, before, tried, strain, slope)
    integer, intent(in) :: n
    real(wp), intent(in) :: bulk, shear
    real(wp), intent(in), dimension(n, 6) :: before, tried, strain
    real(wp), intent(out) :: slope(n)
    real(wp), parameter :: least = 1.0e-20_wp   ! square of plastic over elastic stress: round-off
    real(wp) :: p1, p2, p3, p4, d1, d2, d3, mean, flow, deviator, trial, share
    integer :: l

    !$omp simd private(p1, p2, p3, p4, d1, d2, d3, mean, flow, deviator, trial, share)
    do l = 1, n
      ! What the deviator of the trial stress has lost, 2G times the plastic strain.
      mean = (strain(l, 1) + strain(l, 2) + strain(l, 3))*(1.0_wp/3.0_wp)
      p1 = before(l, 1) - tried(l, 1) + 2.0_wp*shear*(strain(l, 1) - mean)
      p2 = before(l, 2) - tried(l, 2) + 2.0_wp*shear*(strain(l, 2) - mean)
      p3 = before(l, 3) - tried(l, 3) + 2.0_wp*shear*(strain(l, 3) - mean)
      p4 = before(l, 4) - tried(l, 4) + shear*strain(l, 4)
      mean = (p1 + p2 + p3)*(1.0_wp/3.0_wp)
      p1 = p1 - mean; p2 = p2 - mean; p3 = p3 - mean
      flow = p1*p1 + p2*p2 + p3*p3 + 2.0_wp*p4*p4
      mean = (tried(l, 1) + tried(l, 2) + tried(l, 3))*(1.0_wp/3.0_wp)
      d1 = tried(l, 1) - mean; d2 = tried(l, 2) - mean; d3 = tried(l, 3) - mean
      deviator = d1*d1 + d2*d2 + d3*d3 + 2.0_wp*tried(l, 4)**2
      trial = (d1 + p1)**2 + (d2 + p2)**2 + (d3 + p3)**2 + 2.0_wp*(tried(l, 4) + p4)**2
      share = 4.0_wp/3.0_wp
      if (flow > least*trial) share = (share - 2.0_wp*p3*p3/flow)*sqrt(min(1.0_wp, deviator/trial))
      slope(l) = bulk + share*shear
    end do
  end subroutine first_slope

end module plane_stress
