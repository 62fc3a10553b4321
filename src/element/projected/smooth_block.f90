!> Between the points of a block and the splines of a smooth projection, with the elements side by
!! side: from points to loads of the splines of each element, and from coefficients to points.
module smooth_block
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use point_fields, only: point_fields_t
  use smooth_fields, only: smooth_fields_t, smooth_table_t
  implicit none
  private

  public :: collect_strain, collect_stress, spread_strain, spread_stress

contains

  !> Loads of the strains of a slot: block `b` of the row (e2, e3), number `block` of the patch.
  pure subroutine collect_strain(patch, b, e2, e3, block, slot, fields)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, e2, e3, block
    type(point_fields_t), intent(in) :: slot          !! with one slot
    type(smooth_fields_t), intent(inout) :: fields
    integer :: k

    call collect_all(patch, 1, b, e2, e3, fields%tables, slot%mean, &
                     fields%loads(:, :, :, :, 1, block))
    do k = 2, size(fields%loads, 5)
      call collect_all(patch, 1, b, e2, e3, fields%tables, slot%growth(:, k - 1, :, 1), &
                       fields%loads(:, :, :, :, k, block))
    end do
  end subroutine collect_strain

  !> The same of its stresses, with the transposed operators.
  pure subroutine collect_stress(patch, b, e2, e3, block, slot, fields)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, e2, e3, block
    type(point_fields_t), intent(in) :: slot
    type(smooth_fields_t), intent(inout) :: fields

    call collect_all(patch, 2, b, e2, e3, fields%tables, slot%mean, &
                     fields%loads(:, :, :, :, 1, block))
  end subroutine collect_stress

  !> Put the projected strains into a slot.
  pure subroutine spread_strain(patch, b, e2, e3, fields, slot)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, e2, e3
    type(smooth_fields_t), intent(in) :: fields
    type(point_fields_t), intent(inout) :: slot
    integer :: k

    call spread_mean(patch, 1, b, e2, e3, fields, slot)
    do k = 2, size(fields%all, 4)
      call spread_all(patch, 1, b, e2, e3, fields%tables, shape(fields%all(:, :, :, 1)), &
                      fields%all(:, :, :, k), slot%growth(:, k - 1, :, 1))
    end do
  end subroutine spread_strain

  !> Put the projected stresses into a slot.
  pure subroutine spread_stress(patch, b, e2, e3, fields, slot)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, e2, e3
    type(smooth_fields_t), intent(in) :: fields
    type(point_fields_t), intent(inout) :: slot

    call spread_mean(patch, 2, b, e2, e3, fields, slot)
  end subroutine spread_stress

  pure subroutine spread_mean(patch, way, b, e2, e3, fields, slot)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: way, b, e2, e3            !! strains 1, stresses 2
    type(smooth_fields_t), intent(in) :: fields
    type(point_fields_t), intent(inout) :: slot

    call spread_all(patch, way, b, e2, e3, fields%tables, shape(fields%all(:, :, :, 1)), &
                    fields%all(:, :, :, 1), slot%mean)
  end subroutine spread_mean

  pure subroutine collect_all(patch, way, b, e2, e3, tables, field, loads)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: way, b, e2, e3
    type(smooth_table_t), intent(in) :: tables(3)
    real(wp), intent(in) :: field(*)                 !! (8, q3, q2, q1)
    real(wp), intent(inout) :: loads(*)              !! (8, p3, p2, p1)
    real(wp) :: half(n_lanes*product(patch%axes%n_points)), whole(size(half))

    associate (q => patch%axes%n_points, p => patch%axes%degree)
      call combine(1, q(3), p(3), q(2)*q(1), tables(3)%to_loads(:, :, :, e3, way), field, half)
      call combine(p(3), q(2), p(2), q(1), tables(2)%to_loads(:, :, :, e2, way), half, whole)
      call combine(p(3)*p(2), q(1), p(1), 1, tables(1)%to_loads(:, :, :, b, way), whole, loads)
    end associate
  end subroutine collect_all

  pure subroutine spread_all(patch, way, b, e2, e3, tables, n, coefficients, field)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: way, b, e2, e3
    type(smooth_table_t), intent(in) :: tables(3)
    integer, intent(in) :: n(3)                      !! splines along the axes
    real(wp), intent(in) :: coefficients(n(1), n(2), n(3))
    real(wp), intent(inout) :: field(*)              !! (8, q3, q2, q1)
    real(wp) :: half(n_lanes*product(patch%axes%n_points)), whole(size(half))
    real(wp) :: lanes(n_lanes, patch%axes(3)%degree, patch%axes(2)%degree, patch%axes(1)%degree)
    integer :: i, j, k

    associate (q => patch%axes%n_points, p => patch%axes%degree, &
               first2 => patch%axes(2)%first(e2), first3 => patch%axes(3)%first(e3))
      do i = 1, p(1)
        do j = 1, p(2)
          do k = 1, p(3)
            call gather_lanes(patch, b, i, coefficients(:, first2 + j - 1, first3 + k - 1), &
                              lanes(:, k, j, i))
          end do
        end do
      end do
      call combine(p(3)*p(2), p(1), q(1), 1, tables(1)%to_points(:, :, :, b, way), lanes, half)
      call combine(p(3), p(2), q(2), q(1), tables(2)%to_points(:, :, :, e2, way), half, whole)
      call combine(1, p(3), q(3), q(2)*q(1), tables(3)%to_points(:, :, :, e3, way), whole, field)
    end associate
  end subroutine spread_all

  !> Coefficients of spline `a` of the eight elements.
  pure subroutine gather_lanes(patch, b, a, coefficients, lanes)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, a
    real(wp), intent(in) :: coefficients(*)
    real(wp), intent(out) :: lanes(n_lanes)
    integer :: first(n_lanes), l

    first = patch%lanes%first(:, b) + a - 1
    if (patch%lanes%is_contiguous(b)) then
      lanes = coefficients(first(1):first(1) + n_lanes - 1)
    else
      do l = 1, n_lanes
        lanes(l) = coefficients(first(l))
      end do
    end if
  end subroutine gather_lanes

  !> Sums along the middle index, lane by lane. Those of quadratic splines with three points are
  !! written out: each term is read once, no sum goes to memory and back.
  pure subroutine combine(m, n_in, n_out, n, factors, from, to)
    integer, intent(in) :: m, n_in, n_out, n
    real(wp), intent(in) :: factors(8, n_in, n_out), from(8, m, n_in, n)
    real(wp), intent(inout) :: to(8, m, n_out, n)      !! set
    integer :: l, i, j, k, a

    do k = 1, n
      if (n_in == 2 .and. n_out == 3) then
        do i = 1, m
          !$omp simd
          do l = 1, 8
            to(l, i, 1, k) = factors(l, 1, 1)*from(l, i, 1, k) + factors(l, 2, 1)*from(l, i, 2, k)
            to(l, i, 2, k) = factors(l, 1, 2)*from(l, i, 1, k) + factors(l, 2, 2)*from(l, i, 2, k)
            to(l, i, 3, k) = factors(l, 1, 3)*from(l, i, 1, k) + factors(l, 2, 3)*from(l, i, 2, k)
          end do
        end do
      else if (n_in == 3 .and. n_out == 2) then
        do i = 1, m
          !$omp simd
          do l = 1, 8
            to(l, i, 1, k) = factors(l, 1, 1)*from(l, i, 1, k) &
                             + factors(l, 2, 1)*from(l, i, 2, k) &
                             + factors(l, 3, 1)*from(l, i, 3, k)
            to(l, i, 2, k) = factors(l, 1, 2)*from(l, i, 1, k) &
                             + factors(l, 2, 2)*from(l, i, 2, k) &
                             + factors(l, 3, 2)*from(l, i, 3, k)
          end do
        end do
      else
        do j = 1, n_out
          to(:, :, j, k) = 0.0_wp
          do a = 1, n_in
            do i = 1, m
              !$omp simd
              do l = 1, 8
                to(l, i, j, k) = to(l, i, j, k) + factors(l, a, j)*from(l, i, a, k)
              end do
            end do
          end do
        end do
      end if
    end do
  end subroutine combine

end module smooth_block
