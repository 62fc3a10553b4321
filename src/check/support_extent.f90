!> Where the blank and the control points of a set lie, and whether a set is a plane of symmetry.
module support_extent
  use kinds, only: wp
  use scene, only: scene_t, is_held
  implicit none
  private

  public :: extent_t, extent_of, is_across, find_box, held_ends

  real(wp), parameter, public :: round_off = 1.0e-6_wp   !! of the size of the blank

  !> Bounds of the control points of a set at the start, and how the blank lies.
  type :: extent_t
    real(wp) :: low(3) = huge(1.0_wp), high(3) = -huge(1.0_wp)   !! [length]
    real(wp) :: thickness = 0.0_wp, size = 0.0_wp   !! of the blank [length]
    integer :: across = 3                      !! coordinate that its thickness runs along
    logical :: is_all = .true.                 !! all control points of the blank
    logical :: has_face = .false.              !! an edge face of a patch as a whole
  end type extent_t

contains

  !> Bounds of the control points of the blank at the start.
  pure subroutine find_box(scene, low, high)
    type(scene_t), intent(in) :: scene
    real(wp), intent(out) :: low(3), high(3)   !! [length]
    integer :: p, c

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do p = 1, size(scene%blank%patches)
      do c = 1, 3
        low(c) = min(low(c), minval(scene%blank%patches(p)%solid%points(:, :, :, c)))
        high(c) = max(high(c), maxval(scene%blank%patches(p)%solid%points(:, :, :, c)))
      end do
    end do
  end subroutine find_box

  !> Do the points lie in a plane across the component, on all of an edge face of the blank?
  pure logical function is_across(extent, c)
    type(extent_t), intent(in) :: extent
    integer, intent(in) :: c

    is_across = extent%has_face .and. extent%high(c) - extent%low(c) <= round_off*extent%size
  end function is_across

  !> At which of the two ends of the blank along coordinate `across` all of an edge face has a
  !! component held, from the first step on.
  pure function held_ends(scene, component, across) result(is_held_at)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: component, across
    logical :: is_held_at(2)
    type(extent_t) :: extent
    real(wp) :: low(3), high(3)
    integer :: i

    call find_box(scene, low, high)
    is_held_at = .false.
    do i = 1, size(scene%boundaries)
      associate (boundary => scene%boundaries(i))
        if (.not. boundary%is_prescribed(component) .or. boundary%first_step > 1) cycle
        extent = extent_of(scene, boundary%set)
      end associate
      if (.not. is_across(extent, across)) cycle
      is_held_at = is_held_at .or. [extent%low(across) <= low(across) + round_off*extent%size, &
                                    extent%high(across) >= high(across) - round_off*extent%size]
    end do
  end function held_ends

  !> Where the control points of a set lie.
  pure function extent_of(scene, set) result(extent)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set
    type(extent_t) :: extent
    logical, allocatable :: is_in(:, :, :)
    real(wp) :: low(3), high(3), normal(3)
    integer :: p, d

    call find_box(scene, low, high)
    extent%size = norm2(high - low)
    do p = 1, size(scene%blank%patches)
      associate (x => scene%blank%patches(p)%solid%points)
        is_in = is_held(scene%blank%patches(p)%solid, scene%sets(set), p)
        extent%is_all = extent%is_all .and. all(is_in)
        extent%has_face = extent%has_face .or. all(is_in(1, :, :)) .or. &
                          all(is_in(size(is_in, 1), :, :)) .or. all(is_in(:, 1, :)) .or. &
                          all(is_in(:, size(is_in, 2), :))
        normal = x(1, 1, size(x, 3), :) - x(1, 1, 1, :)
        if (norm2(normal) > extent%thickness) extent%across = maxloc(abs(normal), 1)
        extent%thickness = max(extent%thickness, norm2(normal))
        do d = 1, 3
          extent%low(d) = min(extent%low(d), minval(x(:, :, :, d), mask=is_in))
          extent%high(d) = max(extent%high(d), maxval(x(:, :, :, d), mask=is_in))
        end do
      end associate
    end do
  end function extent_of

end module support_extent
