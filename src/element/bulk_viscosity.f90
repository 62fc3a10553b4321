!> Bulk viscosity: a pressure against the rate of the volume strain, linear and quadratic (J. von
!! Neumann and R. D. Richtmyer, J. Appl. Phys. 21 (1950)). The kernels add it to the stress by the
!! factors of `viscous_factors`; it is not part of the stress that is kept.
module bulk_viscosity
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  implicit none
  private

  public :: new_viscosity, set_wave_speed, viscous_factors, damping_ratio_of, scale_viscosity
  public :: bending_factors

  !> Its constants; the lengths are those of the elements at the start, all of them only where it is
  !! active.
  type, public :: viscosity_t
    logical :: is_active = .false.
    real(wp) :: linear = 0.0_wp, quadratic = 0.0_wp
    real(wp) :: bending = 0.0_wp                !! of shells, see `bending_factors`
    real(wp) :: density = 0.0_wp, wave_speed = 0.0_wp
    real(wp), allocatable :: length(:, :)       !! shape (8, n_blocks)
  end type viscosity_t

contains

  !> From the linear and the quadratic factor; active when either is positive.
  pure function new_viscosity(factors, law, lengths) result(viscosity)
    real(wp), intent(in) :: factors(2)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: lengths(:, :)       !! of the elements, shape (8, n_blocks)
    type(viscosity_t) :: viscosity

    viscosity%is_active = any(factors > 0.0_wp)
    viscosity%linear = factors(1)
    viscosity%quadratic = factors(2)
    viscosity%density = law%density
    call set_wave_speed(viscosity, law)
    if (viscosity%is_active) viscosity%length = lengths
  end function new_viscosity

  !> Speed of pressure waves from the moduli of the law.
  pure subroutine set_wave_speed(viscosity, law)
    type(viscosity_t), intent(inout) :: viscosity
    class(block_law_t), intent(in) :: law

    viscosity%wave_speed = sqrt((law%bulk + 4.0_wp/3.0_wp*law%shear)/law%density)
  end subroutine set_wave_speed

  !> That of a material whose mass is larger by a factor.
  pure subroutine scale_viscosity(viscosity, factor)
    type(viscosity_t), intent(inout) :: viscosity
    real(wp), intent(in) :: factor

    viscosity%density = viscosity%density*factor
    viscosity%wave_speed = viscosity%wave_speed/sqrt(factor)
  end subroutine scale_viscosity

  !> Viscous stress per volume strain of a step (linear, quadratic) for the lanes of a block.
  pure function viscous_factors(viscosity, block, dt) result(factors)
    type(viscosity_t), intent(in) :: viscosity
    integer, intent(in) :: block                !! its number
    real(wp), intent(in) :: dt
    real(wp) :: factors(n_lanes, 2)
    real(wp) :: linear, quadratic
    integer :: l

    factors = 0.0_wp
    if (.not. viscosity%is_active) return
    linear = viscosity%linear*viscosity%density*viscosity%wave_speed/dt
    quadratic = viscosity%density*(viscosity%quadratic/dt)**2
    !$omp simd
    do l = 1, n_lanes
      factors(l, 1) = linear*viscosity%length(l, block)
      factors(l, 2) = quadratic*viscosity%length(l, block)**2
    end do
  end function viscous_factors

  !> Viscous moment of a shell per thickness, thickness and change of the trace of the curvature
  !! over a step: moments b rho c L^2 h^2/12 against the rate of that trace. A bending wave of the
  !! angular frequency 2 c h/L^2, which is about the largest of elements of the length L, gets the
  !! damping ratio b, as a pressure wave of 2 c/L does by the linear factor.
  pure function bending_factors(viscosity, block, dt) result(factors)
    type(viscosity_t), intent(in) :: viscosity
    integer, intent(in) :: block                !! its number
    real(wp), intent(in) :: dt
    real(wp) :: factors(n_lanes)

    factors = 0.0_wp
    if (.not. viscosity%is_active) return
    factors = (viscosity%bending*viscosity%density*viscosity%wave_speed/(12.0_wp*dt)) &
              *viscosity%length(:, block)**2
  end function bending_factors

  !> Largest damping ratio of the linear viscosity, from the largest frequency and that of the bulk
  !! part of the stiffness alone.
  pure real(wp) function damping_ratio_of(viscosity, bulk, omega, omega_bulk) result(ratio)
    type(viscosity_t), intent(in) :: viscosity
    real(wp), intent(in) :: bulk                  !! modulus [stress]
    real(wp), intent(in) :: omega, omega_bulk     !! angular frequencies [1/time]
    real(wp) :: lag

    ratio = 0.0_wp
    if (.not. viscosity%is_active) return
    lag = viscosity%linear*viscosity%density*viscosity%wave_speed*maxval(viscosity%length)/bulk
    ratio = 0.5_wp*lag*omega_bulk**2/omega
  end function damping_ratio_of

end module bulk_viscosity
