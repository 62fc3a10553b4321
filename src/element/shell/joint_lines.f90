!> Lines along which a mid-surface may turn without bending: seams of patches, the seam of a patch
!! that closes upon itself, and knots as often as the degree.
module joint_lines
  use knot_vector, only: knot_vector_t
  use nurbs_solid, only: nurbs_solid_t
  use patch_seams, only: seams_t, group_table
  implicit none
  private

  public :: side_t, joint_line_t, find_joint_lines

  !> The sheet on one side of a line: a row of control points, and the next one away from it.
  type :: side_t
    integer :: part = 0
    integer :: across = 1                !! axis across the line
    integer :: row = 1, next = 2         !! places along that axis
    logical :: is_reversed = .false.     !! runs against the first side of the line
  end type side_t

  !> Two sides of a line. A line at which n sheets meet comes once for each two of them.
  type :: joint_line_t
    type(side_t) :: sides(2)
    integer :: n_sheets = 2
  end type joint_line_t

  !> An edge of a patch and the seams of its control points.
  type :: edge_t
    type(side_t) :: side
    integer, allocatable :: group(:)     !! 0: none
  end type edge_t

contains

  !> All lines of the mid-surfaces, by patch.
  pure function find_joint_lines(middles, seams) result(lines)
    type(nurbs_solid_t), intent(in) :: middles(:)   !! grids with one control point across
    type(seams_t), intent(in) :: seams
    type(joint_line_t), allocatable :: lines(:)

    allocate (lines(0))
    call add_inner_lines(middles, lines)
    if (seams%n_groups > 0) call add_seams(edges_of(middles, seams), lines)
  end function find_joint_lines

  !> Places of the control points at inner knots that come as often as the degree.
  pure function hinge_knots(axis) result(places)
    type(knot_vector_t), intent(in) :: axis
    integer, allocatable :: places(:)
    integer :: i

    places = pack([(i, i=2, axis%n_basis - 1)], &
                  .not. axis%knots(2 + axis%degree:axis%n_basis - 1 + axis%degree) &
                  > axis%knots(3:axis%n_basis))
  end function hinge_knots

  pure subroutine add_inner_lines(middles, lines)
    type(nurbs_solid_t), intent(in) :: middles(:)
    type(joint_line_t), allocatable, intent(inout) :: lines(:)
    type(joint_line_t) :: line
    integer, allocatable :: places(:)
    integer :: p, axis, i

    do p = 1, size(middles)
      do axis = 1, 2
        places = hinge_knots(middles(p)%axes(axis))
        do i = 1, size(places)
          line%sides(1) = side_t(p, axis, places(i), places(i) - 1)
          line%sides(2) = side_t(p, axis, places(i), places(i) + 1)
          lines = [lines, line]
        end do
      end do
    end do
  end subroutine add_inner_lines

  pure function edges_of(middles, seams) result(edges)
    type(nurbs_solid_t), intent(in) :: middles(:)
    type(seams_t), intent(in) :: seams
    type(edge_t) :: edges(4*size(middles))
    integer, allocatable :: group(:, :)
    integer :: p, e, axis, n(2)

    do p = 1, size(middles)
      n = middles(p)%axes(:2)%n_basis
      group = reshape(group_table(seams, p, product(n)), n)
      do e = 1, 4
        axis = merge(1, 2, e <= 2)
        associate (edge => edges(4*(p - 1) + e))
          edge%side = side_t(p, axis, 1, 2)
          if (mod(e, 2) == 0) edge%side = side_t(p, axis, n(axis), n(axis) - 1)
          if (axis == 1) edge%group = group(edge%side%row, :)
          if (axis == 2) edge%group = group(:, edge%side%row)
        end associate
      end do
    end do
  end function edges_of

  !> Every two edges whose control points are the same, but for those of a pole.
  pure subroutine add_seams(edges, lines)
    type(edge_t), intent(in) :: edges(:)
    type(joint_line_t), allocatable, intent(inout) :: lines(:)
    type(joint_line_t) :: line
    integer :: i, j, k, n_sheets

    do i = 1, size(edges)
      if (any(edges(i)%group == 0) .or. all(edges(i)%group == edges(i)%group(1))) cycle
      n_sheets = count([(are_one(edges(i)%group, edges(k)%group), k=1, size(edges))])
      do j = i + 1, size(edges)
        if (.not. are_one(edges(i)%group, edges(j)%group)) cycle
        line%n_sheets = n_sheets
        line%sides = [edges(i)%side, edges(j)%side]
        line%sides(2)%is_reversed = any(edges(i)%group /= edges(j)%group)
        lines = [lines, line]
      end do
    end do
  end subroutine add_seams

  pure logical function are_one(a, b)
    integer, intent(in) :: a(:), b(:)

    are_one = size(a) == size(b)
    if (are_one) are_one = all(a == b) .or. all(a == b(size(b):1:-1))
  end function are_one

end module joint_lines
