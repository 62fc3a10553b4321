!> Stress update of the points of a block from projected strains, and stress times volume for the
!! forces. Laws that look at the deformation gradient get one with the projected volume.
module projected_stress
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use point_context, only: point_context_t
  use tensor_rotation, only: rotate_by_spin, turn_to_end
  implicit none
  private

  public :: stress_of_block, logarithmic_volumes, set_volumes, scale_volumes

contains

  !> Stress, state, work and stress times volume of all rows of a block.
  subroutine stress_of_block(law, q, dt, is_viscous, viscous, spin, dstrain, volume, &
                             end_volume, context, gradients, place, stress, state, push, weighted, &
                             sums, ok)
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: q(3)
    real(wp), intent(in) :: dt
    logical, intent(in) :: is_viscous
    real(wp), intent(in) :: viscous(n_lanes, 2)            !! see `viscous_factors`
    real(wp), intent(in) :: spin(8, q(3), 3, q(1)*q(2))
    real(wp), intent(inout) :: dstrain(8, q(3), 6, q(1)*q(2))   !! turned to the end of the step
    real(wp), intent(in), dimension(8, q(3), q(1)*q(2)) :: volume, end_volume
    type(point_context_t), intent(inout) :: context
    real(wp), intent(in) :: gradients(8*q(3), 18, *), place(8*q(3), 3, *)   !! context only
    real(wp), intent(inout) :: stress(8, q(3), 6, q(1)*q(2))
    real(wp), intent(inout) :: state(8, q(3), law%n_state, q(1)*q(2))
    real(wp), intent(inout) :: push(8, q(3), q(1)*q(2))    !! viscous stress
    real(wp), intent(out) :: weighted(8, q(3), 6, q(1)*q(2))
    real(wp), intent(inout) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    integer :: row, qc, l
    logical :: row_ok

    ok = .true.
    do row = 1, q(1)*q(2)
      if (.not. law%is_rotating) then
        call turn_to_end(8*q(3), spin(:, :, :, row), dstrain(:, :, :, row))
        call rotate_by_spin(8*q(3), spin(:, :, :, row), stress(:, :, :, row))
      end if
      call add_work(q(3), stress(:, :, :, row), dstrain(:, :, :, row), volume(:, :, row), sums)
      if (law%needs_context) then
        context%row = row
        context%f0 = gradients(:, 1:9, row)
        context%f1 = gradients(:, 10:18, row)
        context%place = place(:, :, row)
        context%point = [(((row - 1)/q(2) + 1 + q(1)*(mod(row - 1, q(2)) + q(2)*(qc - 1)), &
                           l=1, 8), qc=1, q(3))]
        call law%update_in_context(context, dt, dstrain(:, :, :, row), stress(:, :, :, row), &
                                   state(:, :, :, row), row_ok, spin(:, :, :, row))
      else
        call law%update(8*q(3), dt, dstrain(:, :, :, row), stress(:, :, :, row), &
                        state(:, :, :, row), row_ok, spin(:, :, :, row))
      end if
      ok = ok .and. row_ok
      call add_work(q(3), stress(:, :, :, row), dstrain(:, :, :, row), volume(:, :, row), sums)
      call weigh(q(3), stress(:, :, :, row), end_volume(:, :, row), weighted(:, :, :, row))
      if (is_viscous) call add_viscous(q(3), dstrain(:, :, :, row), viscous, volume(:, :, row), &
                                       end_volume(:, :, row), push(:, :, row), &
                                       weighted(:, :, :, row), sums)
    end do
  end subroutine stress_of_block

  !> Half of the stress power of a row, see `flux_row` of the kernel.
  pure subroutine add_work(n, stress, dstrain, volume, sums)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(8, n, 6), dstrain(8, n, 6), volume(8, n)
    real(wp), intent(inout) :: sums(8, 4)
    integer :: l, q

    do q = 1, n
      !$omp simd
      do l = 1, 8
        sums(l, 1) = sums(l, 1) + 0.5_wp*volume(l, q) &
                     *(stress(l, q, 1)*dstrain(l, q, 1) + stress(l, q, 2)*dstrain(l, q, 2) &
                       + stress(l, q, 3)*dstrain(l, q, 3) + stress(l, q, 4)*dstrain(l, q, 4) &
                       + stress(l, q, 5)*dstrain(l, q, 5) + stress(l, q, 6)*dstrain(l, q, 6))
      end do
    end do
  end subroutine add_work

  pure subroutine weigh(n, stress, volume, weighted)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(8*n, 6), volume(8*n)
    real(wp), intent(out) :: weighted(8*n, 6)
    integer :: c

    do c = 1, 6
      weighted(:, c) = stress(:, c)*volume
    end do
  end subroutine weigh

  !> Viscous stress, see `add_viscous` of the kernel.
  pure subroutine add_viscous(n, dstrain, viscous, volume, end_volume, push, weighted, sums)
    integer, intent(in) :: n
    real(wp), intent(in) :: dstrain(8, n, 6), viscous(8, 2), volume(8, n), end_volume(8, n)
    real(wp), intent(inout) :: push(8, n), weighted(8, n, 6), sums(8, 4)
    real(wp) :: growth, now
    integer :: l, q

    do q = 1, n
      !$omp simd private(growth, now)
      do l = 1, 8
        growth = dstrain(l, q, 1) + dstrain(l, q, 2) + dstrain(l, q, 3)
        now = growth*(viscous(l, 1) + viscous(l, 2)*max(0.0_wp, -growth))
        sums(l, 2) = sums(l, 2) + 0.5_wp*volume(l, q)*growth*(push(l, q) + now)
        push(l, q) = now
        weighted(l, q, 1) = weighted(l, q, 1) + now*end_volume(l, q)
        weighted(l, q, 2) = weighted(l, q, 2) + now*end_volume(l, q)
        weighted(l, q, 3) = weighted(l, q, 3) + now*end_volume(l, q)
      end do
    end do
  end subroutine add_viscous

  !> Logarithms of the determinants of F at the start (1) and the end (2) of the step.
  pure subroutine logarithmic_volumes(n, gradients, growth)
    integer, intent(in) :: n(2)                               !! points of a row, rows
    real(wp), intent(in) :: gradients(n(1), 9, 2, n(2))
    real(wp), intent(out) :: growth(n(1), 2, n(2))
    integer :: row, k

    do row = 1, n(2)
      do k = 1, 2
        growth(:, k, row) = log(determinants(n(1), gradients(:, :, k, row)))
      end do
    end do
  end subroutine logarithmic_volumes

  !> Scale F, so that its determinant is the projected one.
  pure subroutine set_volumes(n, growth, gradients)
    integer, intent(in) :: n(2)
    real(wp), intent(inout) :: growth(n(1), 2, n(2))          !! projected logarithms, then
                                                              !! what they exceed the own ones by
    real(wp), intent(inout) :: gradients(n(1), 9, 2, n(2))
    integer :: row, k, c

    do row = 1, n(2)
      do k = 1, 2
        growth(:, k, row) = growth(:, k, row) &
                            - log(determinants(n(1), gradients(:, :, k, row)))
        do c = 1, 9
          gradients(:, c, k, row) = gradients(:, c, k, row)*exp(growth(:, k, row)/3.0_wp)
        end do
      end do
    end do
  end subroutine set_volumes

  !> Volumes that belong to scaled gradients: a law with an energy per volume at the start needs
  !! them, for its forces to be the slopes of that energy.
  pure subroutine scale_volumes(n, growth, volume, end_volume)
    integer, intent(in) :: n(2)
    real(wp), intent(in) :: growth(n(1), 2, n(2))             !! from `set_volumes`
    real(wp), intent(inout), dimension(n(1), n(2)) :: volume, end_volume

    volume = volume*exp(0.5_wp*(growth(:, 1, :) + growth(:, 2, :)))
    end_volume = end_volume*exp(growth(:, 2, :))
  end subroutine scale_volumes

  pure function determinants(n, f) result(values)
    integer, intent(in) :: n
    real(wp), intent(in) :: f(n, 9)
    real(wp) :: values(n)

    values = f(:, 1)*(f(:, 5)*f(:, 9) - f(:, 6)*f(:, 8)) &
             + f(:, 2)*(f(:, 6)*f(:, 7) - f(:, 4)*f(:, 9)) &
             + f(:, 3)*(f(:, 4)*f(:, 8) - f(:, 5)*f(:, 7))
  end function determinants

end module projected_stress
