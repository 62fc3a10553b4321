!> Whether the surfaces of a tool are shapes that a sheet can lie on: not folded over themselves,
!! without gaps and overlaps where they meet.
module shape_check
  use kinds, only: wp
  use failure, only: error_t
  use text, only: rounded_text, place_text
  use input_errors, only: origin_t, error_list_t, add_warning
  use surface_grid, only: lines
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use tool, only: tool_t, new_tool
  use linear_algebra, only: cross
  use tool_face, only: unit_normal, face_position
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  use tool_points, only: tool_point_t, border_points, length_along
  implicit none
  private

  public :: check_shape, find_fold, find_misfits, misfit_t

  !> The worst of a kind.
  type :: misfit_t
    real(wp) :: size = 0.0_wp                 !! [length]; 0: none
    real(wp) :: x(3) = 0.0_wp
    integer :: surfaces(2) = 0
  end type misfit_t

  integer, parameter :: n_parts = 4           !! of a knot span, between which normals are compared
  real(wp), parameter :: flipped = -0.5_wp    !! cosine between two of them, 120 degrees
  real(wp), parameter :: back = -0.95_wp      !! the same at knot lines, 160 degrees
  real(wp), parameter :: sewn = 0.01_wp       !! distance, of the thickness, that counts as none
  real(wp), parameter :: aligned = 0.95_wp    !! cosine between surfaces that lie on each other

  real(wp), parameter :: along = 0.3_wp       !! cosine of a way to the edge that it runs along

  !> A surface of a tool as a tool of its own, made when a point is near it.
  type :: piece_t
    real(wp) :: box(3, 2) = 0.0_wp            !! around its control points
    type(tool_t) :: tool
    logical :: is_made = .false.
  end type piece_t

contains

  !> Warn of folds, gaps and overlaps of a tool.
  subroutine check_shape(tool, thickness, origin, errors)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(origin_t), intent(in) :: origin
    type(error_list_t), intent(inout) :: errors
    type(misfit_t) :: gap, overlap
    real(wp) :: x(3)
    logical :: is_folded
    integer :: s

    do s = 1, size(tool%surfaces)
      call find_fold(tool%surfaces(s), is_folded, x)
      if (.not. is_folded) cycle
      call add_warning(errors, origin, "the tool '"//tool%name//"', whose surface folds over "// &
                       "itself at "//place_text(x)//": its normal flips", &
                       "a surface without folds; an offset must stay below the smallest radius")
      exit
    end do
    if (size(tool%surfaces) == 1) return
    call find_misfits(tool, thickness, gap, overlap)
    if (gap%size > 0.0_wp) call add_warning(errors, origin, "a gap of "// &
      rounded_text(gap%size)//" between two surfaces of the tool '"//tool%name//"' at "// &
      place_text(gap%x), "surfaces that meet to within a hundredth of the thickness, "// &
      rounded_text(sewn*thickness))
    if (overlap%size > 0.0_wp) call add_warning(errors, origin, "two surfaces of the tool '"// &
      tool%name//"' that overlap by "//rounded_text(overlap%size)//" at "// &
      place_text(overlap%x), "surfaces that meet at their edges")
  end subroutine check_shape

  !> Does the normal of a surface flip from one sample to the next? There lies a fold.
  pure subroutine find_fold(surface, is_folded, x)
    type(nurbs_surface_t), intent(in) :: surface
    logical, intent(out) :: is_folded
    real(wp), intent(out) :: x(3)             !! where it is
    real(wp), allocatable :: xi(:), eta(:), normals(:, :, :)
    real(wp) :: d1(3, 2)
    integer :: i, j

    xi = lines(surface%axes(1), n_parts)
    eta = lines(surface%axes(2), n_parts)
    allocate (normals(3, size(xi), size(eta)))
    is_folded = .false.
    do j = 1, size(eta)
      do i = 1, size(xi)
        call evaluate_surface(surface, [xi(i), eta(j)], x, d1)
        normals(:, i, j) = unit_normal(d1)
        if (i > 1) is_folded = dot_product(normals(:, i, j), normals(:, i - 1, j)) < limit(i)
        if (j > 1) is_folded = is_folded .or. &
          dot_product(normals(:, i, j), normals(:, i, j - 1)) < limit(j)
        if (is_folded) return
      end do
    end do
  contains

    !> Next to a knot line, which may be a sharp edge, the surface must run back on itself.
    pure real(wp) function limit(i)
      integer, intent(in) :: i

      limit = merge(flipped, back, mod(i - 1, n_parts) > 1)
    end function limit

  end subroutine find_fold

  !> The widest gap and the widest overlap between surfaces of a tool, up to a sheet thickness: what
  !! is farther apart is meant to be. Edges that meet others are neither.
  subroutine find_misfits(tool, thickness, gap, overlap)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: thickness         !! [length]
    type(misfit_t), intent(out) :: gap, overlap
    type(piece_t), allocatable :: pieces(:)
    type(tool_point_t), allocatable :: border(:)
    integer :: i, d

    allocate (pieces(size(tool%surfaces)))
    do i = 1, size(pieces)
      associate (points => tool%surfaces(i)%points)
        do d = 1, 3
          pieces(i)%box(d, :) = [minval(points(:, :, d)), maxval(points(:, :, d))]
        end do
      end associate
    end do
    border = border_points(tool)
    do i = 1, size(border)
      call compare(tool, pieces, border(i), thickness, gap, overlap)
    end do
  end subroutine find_misfits

  !> A point of an edge against all surfaces but its own.
  subroutine compare(tool, pieces, point, thickness, gap, overlap)
    type(tool_t), intent(in) :: tool
    type(piece_t), intent(inout) :: pieces(:)
    type(tool_point_t), intent(in) :: point
    real(wp), intent(in) :: thickness
    type(misfit_t), intent(inout) :: gap, overlap
    type(hit_t) :: hit, nearest
    type(error_t), allocatable :: error
    real(wp) :: width
    integer :: b, neighbour

    neighbour = 0
    do b = 1, size(pieces)
      associate (piece => pieces(b))
        if (point%surface == b .or. any(point%x < piece%box(:, 1) - thickness) .or. &
            any(point%x > piece%box(:, 2) + thickness)) cycle
        if (.not. piece%is_made) call new_tool(piece%tool, tool%name, tool%surfaces(b:b), &
                                               tool%side, tool%search_distance, error)
        if (allocated(error)) return
        piece%is_made = .true.
        call search_all_faces(piece%tool, point%x, hit)
        if (hit%distance > thickness) cycle
        if (hit%distance < nearest%distance) then
          nearest = hit
          neighbour = b
        end if
        if (is_beside(piece%tool, hit, 0.0_wp) .or. &
            abs(dot_product(hit%normal, point%normal)) < aligned) cycle
        width = width_around(piece%tool, point, sewn*thickness)
        if (width > overlap%size) overlap = misfit_t(width, point%x, [point%surface, b])
      end associate
    end do
    if (neighbour == 0 .or. nearest%distance <= max(gap%size, sewn*thickness)) return
    if (is_across(pieces(neighbour)%tool, nearest, point)) &
      gap = misfit_t(nearest%distance, point%x, [point%surface, neighbour])
  end subroutine compare

  !> How far a surface goes on from a point of an edge that lies on it: the least of inwards and
  !! along the edge both ways.
  real(wp) function width_around(surface, point, step) result(width)
    type(tool_t), intent(in) :: surface
    type(tool_point_t), intent(in) :: point
    real(wp), intent(in) :: step              !! [length]
    real(wp) :: edge(3)

    edge = cross(point%normal, point%outward)
    width = length_along(surface, point%x, -point%outward, step)
    if (width > 0.0_wp) width = min(width, length_along(surface, point%x, edge, step), &
                                    length_along(surface, point%x, -edge, step))
  end function width_around

  !> Does the way to what is nearest run across the edge, and not back? Along it lies a corner that
  !! is no neighbour, and inwards what the edge of a neighbour runs to.
  pure logical function is_across(surface, hit, point)
    type(tool_t), intent(in) :: surface
    type(hit_t), intent(in) :: hit
    type(tool_point_t), intent(in) :: point
    real(wp) :: way(3)

    way = face_position(surface%coefficients, hit%face, hit%at) - point%x
    is_across = abs(dot_product(way, cross(point%normal, point%outward))) &
                < along*hit%distance .and. dot_product(way, point%outward) > -along*hit%distance
  end function is_across

end module shape_check
