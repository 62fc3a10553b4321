!> What results show of the integration points of a shell: stress in the fixed frame, forces and
!! moments per length, elastic energy.
module shell_readings
  use kinds, only: wp
  use linear_algebra, only: cross
  use gauss_rule, only: gauss_rule_t
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, shell_points_t, row_of_point, lane_of_element, &
                         place_of_point, block_at, basis_at, is_block_here
  use tile_exchange, only: sum_of_blocks
  implicit none
  private

  public :: find_energy, read_shell, find_resultants

contains

  !> Elastic energy of the stress in the sheet and the normal stress.
  subroutine find_energy(patch, points, across, law, energy)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(gauss_rule_t), intent(in) :: across         !! rule of the layers
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: energy
    real(wp) :: energies(across%n, patch%together, patch%n_blocks)
    integer :: block, row, layer, n

    n = across%n
    do block = 1, patch%n_blocks
      if (.not. is_block_here(patch, block)) cycle
      do row = 1, patch%together
        do layer = 1, n
          associate (t => across)
            energies(layer, row, block) = 0.5_wp*t%weights(layer)*energy_of_lanes( &
              law%bulk, law%shear, points%volume(:, row, block), points%normal(:, 1, row, block) &
              + t%points(layer)*points%normal(:, 2, row, block), &
              patch%stress(:, layer + n*(row - 1), :, 1, block))
          end associate
        end do
      end do
    end do
    energy = sum_of_blocks(patch, n*patch%together, energies)
  end subroutine find_energy

  pure real(wp) function energy_of_lanes(bulk, shear, volume, normal, s) result(energy)
    !> `s` is that in the sheet, less `normal`.
    real(wp), intent(in) :: bulk, shear, volume(n_lanes), normal(n_lanes), s(n_lanes, 3)
    real(wp) :: mean(n_lanes)

    mean = (s(:, 1) + s(:, 2))*(1.0_wp/3)
    energy = sum(volume*((mean + normal)**2/(2.0_wp*bulk) &
                         + (0.5_wp*((s(:, 1) - mean)**2 + (s(:, 2) - mean)**2 + mean**2) &
                            + s(:, 3)**2)/(2.0_wp*shear)))
  end function energy_of_lanes

  !> Stress in the fixed frame, 11, 22, 33, 12, 13, 23, and state of an element.
  pure subroutine read_shell(patch, points, rule, weights, x, element, stress, state)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(gauss_rule_t), intent(in) :: rule(3)
    real(wp), intent(in) :: weights(:, :), x(:, :, :)   !! of the control points; places [length]
    integer, intent(in) :: element(3)
    real(wp), intent(out) :: stress(:, :, :, :), state(:, :, :, :)
    real(wp) :: t1(3), t2(3)
    integer :: at(2), place(2), qa, qb, qc

    at = lane_of_element(patch, element)
    do qb = 1, rule(2)%n
      do qa = 1, rule(1)%n
        call frame_at(patch, rule, weights, x, element, [qa, qb], t1, t2)
        do qc = 1, rule(3)%n
          place = place_of_point(patch, [qa, qb, qc])
          associate (s => patch%stress(at(2), place(1), :, place(2), at(1)))
            stress(:, qa, qb, qc) = s(1)*dyad(t1, t1) + s(2)*dyad(t2, t2) + s(3)*dyad(t1, t2)
          end associate
          associate (q => points%normal(at(2), :2, qb + rule(2)%n*(qa - 1), at(1)))
            stress(:3, qa, qb, qc) = stress(:3, qa, qb, qc) + q(1) + rule(3)%points(qc)*q(2)
          end associate
          state(:, qa, qb, qc) = patch%state(at(2), place(1), :size(state, 1), place(2), at(1))
        end do
      end do
    end do
  end subroutine read_shell

  !> The moments are positive where they stretch face 6; those that are kept, with the curvature,
  !! are the other way round. The normal stress q + r zeta has a part in both.
  subroutine find_resultants(patch, points, rule, resultants)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(gauss_rule_t), intent(in) :: rule(3)
    real(wp), intent(out) :: resultants(:, :, :, :, :)
    integer :: at(2), row, e1, e2, qa, qb

    do e2 = 1, patch%axes(2)%n_elements
      do e1 = 1, patch%axes(1)%n_elements
        at = lane_of_element(patch, [e1, e2, 1])
        do qb = 1, rule(2)%n
          do qa = 1, rule(1)%n
            row = row_of_point(rule%n, [qa, qb, 1])
            associate (s => points%resultant(at(2), :, row, at(1)), &
                       q => points%normal(at(2), :, row, at(1)), &
                       h => points%thickness(at(2), row, at(1)))
              resultants(:3, qa, qb, e1, e2) = h*[s(1) + s(2) + q(1), s(1) - s(2) + q(1), s(3)]
              resultants(4:, qa, qb, e1, e2) = -h*[s(4) + s(5), s(4) - s(5), s(6)]
              resultants(4:5, qa, qb, e1, e2) = resultants(4:5, qa, qb, e1, e2) &
                                                + q(2)*h**2*(1.0_wp/6)
            end associate
          end do
        end do
      end do
    end do
  end subroutine find_resultants

  !> a b + b a, of one vector once, as 11, 22, 33, 12, 13, 23.
  pure function dyad(a, b) result(c)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: c(6)

    c = [a*b, 0.5_wp*(a([1, 1, 2])*b([2, 3, 3]) + b([1, 1, 2])*a([2, 3, 3]))]
    if (any(abs(a - b) > 0.0_wp)) c = 2.0_wp*c
  end function dyad

  !> Unit vectors of the frame of a point now.
  pure subroutine frame_at(patch, rule, weights, x, element, point, t1, t2)
    type(solid_patch_t), intent(in) :: patch
    type(gauss_rule_t), intent(in) :: rule(3)
    real(wp), intent(in) :: weights(:, :), x(:, :, :)
    integer, intent(in) :: element(3), point(2)
    real(wp), intent(out) :: t1(3), t2(3)
    real(wp) :: h(4, 0:2), wx(4), a(3, 2), normal(3)
    real(wp) :: one(patch%axes(1)%degree + 1, 0:2), two(patch%axes(2)%degree + 1, 0:2)
    integer :: i, j, first(2), at(2)

    h = 0.0_wp
    at = lane_of_element(patch, element)
    associate (block => block_at(patch, at(1)))
      call basis_at(patch, block, at(2), row_of_point(rule%n, [point, 1]), one, two)
      first = [patch%lanes%first(at(2), block%b), patch%axes(2)%first(block%e2)] - 1
    end associate
    do j = 1, size(two, 1)
      do i = 1, size(one, 1)
        wx = weights(first(1) + i, first(2) + j)*[x(first(1) + i, first(2) + j, :), 1.0_wp]
        h(:, 0) = h(:, 0) + one(i, 0)*two(j, 0)*wx
        h(:, 1) = h(:, 1) + one(i, 1)*two(j, 0)*wx
        h(:, 2) = h(:, 2) + one(i, 0)*two(j, 1)*wx
      end do
    end do
    do i = 1, 2
      a(:, i) = h(:3, i) - h(4, i)/h(4, 0)*h(:3, 0)
    end do
    normal = cross(a(:, 1), a(:, 2))
    t1 = a(:, 1)/norm2(a(:, 1))
    t2 = cross(normal, t1)/norm2(normal)
  end subroutine frame_at

end module shell_readings
