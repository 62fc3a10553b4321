!> A face of the blank as it lies at the start, as something whose closest points can be searched.
module sheet_target
  use kinds, only: wp
  use failure, only: error_t
  use linear_algebra, only: cross
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use blank, only: blank_t
  use tool, only: tool_t, new_tool
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  implicit none
  private

  public :: sheet_target_t, new_sheet_target, is_over

  !> The face of all patches; its normals point out of the blank.
  type :: sheet_target_t
    integer :: face = 0                       !! as the deck numbers it, 0: not usable
    type(tool_t) :: surface
    real(wp) :: thickness = 0.0_wp            !! of the blank [length]
  end type sheet_target_t

contains

  !> Unusable where the surfaces of the face cannot be searched.
  subroutine new_sheet_target(blank, face, thickness, target)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: face
    real(wp), intent(in) :: thickness         !! [length]
    type(sheet_target_t), intent(out) :: target
    type(nurbs_surface_t) :: surfaces(size(blank%parts)), opposite
    type(error_t), allocatable :: error
    integer :: p

    do p = 1, size(surfaces)
      surfaces(p) = blank%parts(p)%element%surface(face)
    end do
    opposite = blank%parts(1)%element%surface(merge(face + 1, face - 1, mod(face, 2) == 1))
    target%thickness = thickness
    call new_tool(target%surface, blank%name, surfaces, outside(surfaces(1), opposite), &
                  3*thickness, error)
    if (.not. allocated(error)) target%face = face
  end subroutine new_sheet_target

  !> Does a point lie above or below the face, not beyond its outline?
  logical function is_over(target, x)
    type(sheet_target_t), intent(in) :: target
    real(wp), intent(in) :: x(3)
    type(hit_t) :: hit

    call search_all_faces(target%surface, x, hit)
    is_over = .not. is_beside(target%surface, hit, 0.0_wp)
  end function is_over

  !> +1 where xi x eta points away from the opposite face, else -1.
  pure integer function outside(surface, opposite) result(side)
    type(nurbs_surface_t), intent(in) :: surface, opposite
    real(wp) :: x(3), below(3), d1(3, 2), normal(3)

    call evaluate_surface(surface, middle(surface), x, d1)
    call evaluate_surface(opposite, middle(opposite), below)
    normal = cross(d1(:, 1), d1(:, 2))
    side = merge(1, -1, dot_product(normal, x - below) > 0.0_wp)
  end function outside

  pure function middle(surface) result(xi)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp) :: xi(2)
    integer :: axis

    do axis = 1, 2
      associate (knots => surface%axes(axis)%knots)
        xi(axis) = 0.5_wp*(knots(1) + knots(size(knots)))
      end associate
    end do
  end function middle

end module sheet_target
