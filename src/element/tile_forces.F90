!> Internal forces of one tile: gather, block kernel of the right instance, add back.
module tile_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t, tile_t, force_report_t, viscosity_t
  use block_exchange, only: gather_block, weigh_block, add_block
  use ig_solid_p222_q222, only: p222_q222 => block_forces
  use ig_solid_p222_q223, only: p222_q223 => block_forces
  use ig_solid_p222_q226, only: p222_q226 => block_forces
  use ig_solid_p222_q333, only: p222_q333 => block_forces
  use ig_solid_p222_q222_rational, only: p222_q222_rational => block_forces
  use ig_solid_p222_q223_rational, only: p222_q223_rational => block_forces
  use ig_solid_p222_q226_rational, only: p222_q226_rational => block_forces
  use ig_solid_p222_q333_rational, only: p222_q333_rational => block_forces
  use ig_solid_general, only: general => block_forces
  use ig_solid_general_rational, only: general_rational => block_forces
  implicit none
  private

  public :: forces_of_tile, kernel_of, kernel_name

  !> Degrees and points of the tuned instances; instance k serves column (k + 1)/2, even ones
  !! are rational, and what comes after the table is general. the calls below follow this order.
  integer, parameter :: tuned(6, 4) = reshape([2, 2, 2, 2, 2, 2, &
                                               2, 2, 2, 2, 2, 3, &
                                               2, 2, 2, 2, 2, 6, &
                                               2, 2, 2, 3, 3, 3], [6, 4])

contains

  !> Number of the kernel instance that serves these degrees and points.
  pure integer function kernel_of(degrees, n_points, is_rational) result(kernel)
    integer, intent(in) :: degrees(3), n_points(3)
    logical, intent(in) :: is_rational
    integer :: row

    do row = 1, size(tuned, 2)
      if (all(tuned(:, row) == [degrees, n_points])) exit
    end do
    kernel = 2*row - merge(0, 1, is_rational)
  end function kernel_of

  !> Name of a kernel instance for the log, such as `p222_q226_rational`.
  pure function kernel_name(kernel) result(name)
    integer, intent(in) :: kernel   !! from `kernel_of`
    character(:), allocatable :: name
    character(9) :: code

    name = "general"
    if (kernel <= 2*size(tuned, 2)) then
      write (code, "('p', 3i1, '_q', 3i1)") tuned(:, (kernel + 1)/2)
      name = code
    end if
    if (mod(kernel, 2) == 0) name = name//"_rational"
  end function kernel_name

  !> Internal forces of the blocks of one tile, on the control points of the tile.
  subroutine forces_of_tile(patch, law, tile, dt, x, v, force, report)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt           !! [time]
    real(wp), intent(in) :: x(:, :, :, :), v(:, :, :, :)   !! end of step, middle of step
    real(wp), intent(out) :: force(tile%control_first(1):tile%control_last(1), &
                                   tile%control_first(2):tile%control_last(2), &
                                   patch%n_control(3), 3)
    type(force_report_t), intent(out) :: report
    real(wp), allocatable :: u(:, :), f(:, :), w(:)   ! on the heap: thread stacks are small
    real(wp) :: sums(n_lanes, 4)
    integer :: p(3), e2, e3, b, block, first(n_lanes), i2, i3, n_values
    logical :: ok, is_contiguous

    p = patch%axes%degree
    n_values = n_lanes*product(p + 1)
    allocate (u(n_values, 6), f(n_values, 3), w(merge(n_values, 0, patch%is_rational)))
    force = 0.0_wp
    do e3 = 1, patch%axes(3)%n_elements
      i3 = patch%axes(3)%first(e3)
      do e2 = tile%row_first, tile%row_last
        i2 = patch%axes(2)%first(e2)
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          first = patch%axes(1)%first(patch%lanes%element(:, b))
          is_contiguous = patch%lanes%is_contiguous(b)
          call gather_block(p, patch%n_control, 3, is_contiguous, first, i2, i3, x, u(:, 1:3))
          call gather_block(p, patch%n_control, 3, is_contiguous, first, i2, i3, v, u(:, 4:6))
          if (patch%is_rational) then
            call gather_block(p, patch%n_control, 1, is_contiguous, first, i2, i3, &
                              patch%weights, w)
            call weigh_block(n_values, 6, w, u)
          end if
          if (patch%is_rational) then
            call run_rational_kernel(patch, law, b, e2, e3, block, dt, u, f, sums, ok)
            call weigh_block(n_values, 3, w, f)
          else
            call run_plain_kernel(patch, law, b, e2, e3, block, dt, u, f, sums, ok)
          end if
          call add_block(p, tile%control_first, tile%control_last, patch%n_control(3), &
                         is_contiguous, first, i2, i3, f, force)
          call add_report(report, sums, ok, block)
        end do
      end do
    end do
  end subroutine forces_of_tile

  !> Sums of a block into the report of its tile.
  pure subroutine add_report(report, sums, ok, block)
    type(force_report_t), intent(inout) :: report
    real(wp), intent(in) :: sums(n_lanes, 4)
    logical, intent(in) :: ok
    integer, intent(in) :: block
    logical :: is_sound

    report%internal_work = report%internal_work + sum(sums(:, 1))
    report%viscous_work = report%viscous_work + sum(sums(:, 2))
    report%largest_rate = max(report%largest_rate, maxval(sums(:, 3)))
    report%smallest_det = min(report%smallest_det, minval(sums(:, 4)))
    ! Written so that a NaN counts as unsound.
    is_sound = ok .and. minval(sums(:, 4)) > 0.0_wp .and. all(abs(sums(:, 1)) < huge(1.0_wp))
    if (.not. is_sound) report%failed_block = min(report%failed_block, block)
  end subroutine add_report

  !> Viscous stress per volume strain of a step (linear, quadratic) for the lanes of a block.
  pure function viscous_factors(viscosity, block, dt) result(factors)
    type(viscosity_t), intent(in) :: viscosity
    integer, intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp) :: factors(n_lanes, 2)

    factors = 0.0_wp
    if (.not. viscosity%is_active) return
    associate (length => viscosity%length(:, block))
      factors(:, 1) = viscosity%linear*viscosity%density*viscosity%wave_speed*length/dt
      factors(:, 2) = viscosity%density*(viscosity%quadratic*length/dt)**2
    end associate
  end function viscous_factors

  !> The instance for a patch without weights; every case passes the same arrays, by their first
  !! elements so that no descriptor is looked at twice.
  subroutine run_plain_kernel(patch, law, b, e2, e3, block, dt, u, f, sums, ok)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: b, e2, e3, block
    real(wp), intent(in) :: dt, u(*)
    real(wp), intent(inout) :: f(*)
    real(wp), intent(out) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 2)
    logical :: on
    integer :: p(3), q(3)

    on = patch%viscosity%is_active
    viscous = viscous_factors(patch%viscosity, block, dt)
    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
    case (1)
      call p222_q222( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case (3)
      call p222_q223( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case (5)
      call p222_q226( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case (7)
      call p222_q333( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case default
      call general( &
        p(1), p(2), p(3), q(1), q(2), q(3), &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    end select
  end subroutine run_plain_kernel

  !> The instance for a patch with weights, as `run_plain_kernel`.
  subroutine run_rational_kernel(patch, law, b, e2, e3, block, dt, u, f, sums, ok)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: b, e2, e3, block
    real(wp), intent(in) :: dt, u(*)
    real(wp), intent(inout) :: f(*)
    real(wp), intent(out) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 2)
    logical :: on
    integer :: p(3), q(3)

    on = patch%viscosity%is_active
    viscous = viscous_factors(patch%viscosity, block, dt)
    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
    case (2)
      call p222_q222_rational( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%rational(1, 1, 1, 1, block), patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case (4)
      call p222_q223_rational( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%rational(1, 1, 1, 1, block), patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case (6)
      call p222_q226_rational( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%rational(1, 1, 1, 1, block), patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case (8)
      call p222_q333_rational( &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%rational(1, 1, 1, 1, block), patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    case default
      call general_rational( &
        p(1), p(2), p(3), q(1), q(2), q(3), &
        law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), &
        patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), &
        patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, &
        patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights, &
        patch%rational(1, 1, 1, 1, block), patch%stress(1, 1, 1, 1, block), &
        patch%state(1, 1, 1, 1, block), f, sums, ok)
    end select
  end subroutine run_rational_kernel

end module tile_forces
