!> Does a quadrature rule see every deformation of a patch? The modes without energy are counted
!! on a small straight patch of the same degrees and at most two elements in each direction:
!! a row one element wide keeps its width, and more elements in a row add no new kind of mode.
module spurious_modes
  use kinds, only: wp
  use failure, only: error_t
  use nurbs_solid, only: nurbs_solid_t
  use primitives, only: box_solid
  use elastic, only: elastic_t, new_elastic
  use block_law, only: block_law_t
  use element, only: element_t, part_t, force_report_t
  use element_kinds, only: new_part
  use strain_projection, only: projection_spec_t, project_nothing
  use linear_algebra, only: eigenvalues
  implicit none
  private

  public :: n_spurious_modes, serving_rule, dense_stiffness

contains

  !> Modes without energy beside the six rigid ones. With `across`, of the motions that are alike
  !! all along that axis and have no component along it, which three rigid ones are.
  integer function n_spurious_modes(degrees, n_elements, n_points, n_parts, projection, across) &
    result(n_modes)
    integer, intent(in) :: degrees(3), n_elements(3)
    integer, intent(in) :: n_points(3), n_parts(3)      !! Gauss points a part, parts an element
    type(projection_spec_t), intent(in) :: projection
    integer, intent(in), optional :: across             !! axis of plane strain, 0: none
    real(wp), parameter :: no_energy = 1.0e-9_wp        ! of the largest eigenvalue
    type(nurbs_solid_t) :: solid
    type(part_t) :: part
    type(elastic_t) :: law
    type(error_t), allocatable :: error
    real(wp), allocatable :: values(:), stiffness(:, :)
    integer :: n(3), n_rigid

    ! At full quadrature nothing can hide: the strain of a mode would vanish at all its points.
    n_modes = 0
    if (projection%kind == project_nothing .and. all(n_points*n_parts > degrees)) return
    n = min(n_elements, 2)
    call box_solid(solid, [0.0_wp, 0.0_wp, 0.0_wp], real(n, wp), degrees, n, &
                   [1.0_wp, 1.0_wp, 1.0_wp], [1, 2, 3], error)
    if (allocated(error)) return
    law = new_elastic(1.0_wp, 1.0_wp, 0.3_wp)
    call new_part(part, "", solid, n_points, n_parts, law, [0.0_wp, 0.0_wp], error, projection)
    if (allocated(error)) return
    stiffness = dense_stiffness(part%element, law)
    n_rigid = 6
    if (present(across)) then
      if (across > 0) then
        stiffness = alike_across(stiffness, shape(solid%weights), across)
        n_rigid = 3
      end if
    end if
    values = eigenvalues(stiffness)
    n_modes = count(abs(values) < no_energy*maxval(values)) - n_rigid
  end function n_spurious_modes

  !> The stiffness against motions that are alike all along an axis, whose component is left out.
  pure function alike_across(stiffness, n, axis) result(alike)
    real(wp), intent(in) :: stiffness(:, :)
    integer, intent(in) :: n(3), axis          !! control points of the patch
    real(wp), allocatable :: alike(:, :)
    integer :: i, j, k, c, row, columns(3), place(n(1), n(2), n(3), 3)

    columns = n
    columns(axis) = 1
    place = 0
    row = 0
    do c = 1, 3
      if (c == axis) cycle
      do k = 1, columns(3)
        do j = 1, columns(2)
          do i = 1, columns(1)
            row = row + 1
            select case (axis)
            case (1)
              place(:, j, k, c) = row
            case (2)
              place(i, :, k, c) = row
            case default
              place(i, j, :, c) = row
            end select
          end do
        end do
      end do
    end do
    allocate (alike(row, row), source=0.0_wp)
    associate (to => reshape(place, [size(place)]))
      do j = 1, size(to)
        do i = 1, size(to)
          if (to(i) > 0 .and. to(j) > 0) &
            alike(to(i), to(j)) = alike(to(i), to(j)) + stiffness(i, j)
        end do
      end do
    end associate
  end function alike_across

  !> The nearest rule without such modes: as many points as the degree in each direction, and if
  !! these do not do, one more along axis 3, then 2, then 1.
  function serving_rule(degrees, n_elements, n_points, n_parts, projection, across) result(rule)
    integer, intent(in) :: degrees(3), n_elements(3), n_points(3), n_parts(3)
    type(projection_spec_t), intent(in) :: projection
    integer, intent(in), optional :: across             !! as for `n_spurious_modes`
    integer :: rule(3), axis

    rule = max(n_points*n_parts, degrees)
    if (n_spurious_modes(degrees, n_elements, rule, [1, 1, 1], projection, across) == 0) return
    do axis = 3, 1, -1
      rule(axis) = max(rule(axis), degrees(axis) + 1)
      if (n_spurious_modes(degrees, n_elements, rule, [1, 1, 1], projection, across) == 0) return
    end do
  end function serving_rule

  !> Stiffness of a stress-free part of few elements: the forces that a tiny motion of each
  !! component raises, symmetric to their second order.
  function dense_stiffness(element, law) result(stiffness)
    class(element_t), intent(in) :: element         !! without stress
    class(block_law_t), intent(in) :: law
    real(wp), allocatable :: stiffness(:, :)
    class(element_t), allocatable :: trial
    type(force_report_t) :: report
    real(wp), allocatable :: unit(:), plus(:)
    real(wp) :: tiny_motion
    integer :: column, n

    allocate (trial, source=element)
    tiny_motion = 1.0e-6_wp*element%shortest
    n = size(element%motion%x)
    allocate (stiffness(n, n), unit(n))
    do column = 1, n
      unit = 0.0_wp
      unit(column) = tiny_motion
      trial%motion%v = reshape(unit, shape(element%motion%x))
      call trial%trial_forces(law, 1.0_wp, report)
      plus = reshape(trial%motion%internal_force, [n])
      trial%motion%v = -trial%motion%v
      call trial%trial_forces(law, 1.0_wp, report)
      stiffness(:, column) = (plus - reshape(trial%motion%internal_force, [n]))/(2.0_wp*tiny_motion)
    end do
  end function dense_stiffness

end module spurious_modes
