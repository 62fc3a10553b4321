!> How a tool comes to the blank that lies as at the start: how near, when they first touch, which
!! way the tool looks, and where an edge of the tool meets the sheet inside its outline.
module approach
  use kinds, only: wp
  use tool, only: tool_t
  use closest_point, only: hit_t, is_beside
  use tool_face, only: face_position
  use tool_search, only: search_all_faces
  use sheet_target, only: sheet_target_t
  use sweep, only: frame_t, in_space, in_tool
  use tool_points, only: tool_point_t, inner_points, border_points, length_along
  implicit none
  private

  public :: approach_t, edge_t, find_approach, rest_on_sheet

  !> A point of an edge of a tool where it touches the sheet, flat on it.
  type :: edge_t
    real(wp) :: overhang = 0.0_wp             !! length of the blank beyond it [length]; 0: none
    real(wp) :: x(3) = 0.0_wp
    real(wp) :: outward(3) = 0.0_wp           !! unit vector out of the tool
    real(wp) :: normal(3) = 0.0_wp            !! of the tool, towards the sheet
    real(wp) :: time = 0.0_wp
  end type edge_t

  !> What a tool and a face of the blank do to each other. Distances are those of sampled points.
  type :: approach_t
    logical :: has_touched = .false.
    type(frame_t) :: first                    !! position of the tool at the first touch
    real(wp) :: contact(3) = 0.0_wp           !! where that is
    real(wp) :: at_start = huge(1.0_wp)       !! distance at the start [length]
    real(wp) :: least = huge(1.0_wp)          !! smallest distance of all positions [length]
    real(wp) :: toward(3) = 0.0_wp            !! unit vector from the blank to the tool there
    integer :: nearest = 1                    !! number of the position that has it
    logical :: is_pressed = .false.           !! some position is inside the blank
    real(wp) :: at_end = 0.0_wp               !! distance at the last position [length]
    real(wp) :: toward_end(3) = 0.0_wp        !! unit vector from the blank to the tool there
    logical :: is_behind = .false.            !! at the start the sheet lies behind the tool
    logical :: is_averted = .false.           !! the face looks away from the tool
    type(edge_t), allocatable :: edges(:)     !! points of edges of the tool
  end type approach_t

  real(wp), parameter :: touch = 0.1_wp       !! gap, of the thickness, that counts as touching
  real(wp), parameter :: near = 0.25_wp       !! further away, that an edge may be to touch too
  real(wp), parameter :: flat = 0.5_wp        !! cosine between the tool at its edge and the sheet
  integer, parameter :: n_halvings = 12       !! of the time between two positions

contains

  !> Follow a tool along its positions until it would be pressed into the blank.
  subroutine find_approach(tool, frames, target, approach)
    type(tool_t), intent(in) :: tool
    type(frame_t), intent(in) :: frames(:)
    type(sheet_target_t), intent(in) :: target
    type(approach_t), intent(out) :: approach
    type(tool_point_t), allocatable :: points(:), border(:), sheet(:)
    type(frame_t) :: frame
    real(wp) :: gap, place(3), away(3)
    integer :: k

    border = border_points(tool)
    points = [inner_points(tool), border]
    sheet = [inner_points(target%surface), border_points(target%surface)]
    allocate (approach%edges(size(border)))
    call find_sides(tool, frames(1), sheet, target, approach)
    do k = 1, size(frames)
      frame = frames(k)
      call find_gap(tool, points, sheet, frame, target, gap, place, away)
      if (k == 1) approach%at_start = norm2(away)
      if (norm2(away) < approach%least) then
        approach%least = norm2(away)
        approach%toward = away/max(norm2(away), tiny(1.0_wp))
        approach%nearest = k
      end if
      approach%at_end = norm2(away)
      approach%toward_end = away/max(norm2(away), tiny(1.0_wp))
      if (gap < -touch*target%thickness) then
        approach%is_pressed = .true.
        if (k == 1) exit
        call step_back(tool, points, sheet, frames(max(k - 1, 1)), target, frame, gap, place)
      end if
      if (gap > touch*target%thickness) cycle
      if (.not. approach%has_touched) then
        approach%first = frame
        approach%contact = place
        approach%has_touched = .true.
      end if
      call check_border(border, frame, gap, target, approach%edges)
      if (frame%time < frames(k)%time) exit
    end do
  end subroutine find_approach

  !> The position along a direction at which a tool that a force moves rests on the sheet.
  subroutine rest_on_sheet(tool, direction, target, frame, way)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: direction(3)      !! unit vector
    type(sheet_target_t), intent(in) :: target
    type(frame_t), intent(inout) :: frame
    real(wp), intent(out) :: way              !! to there, huge if it passes the sheet [length]
    real(wp) :: gap, place(3), away(3)

    call find_gap(tool, [inner_points(tool), border_points(tool)], inner_points(target%surface), &
                  frame, target, gap, place, away)
    way = max(gap, 0.0_wp)
    if (gap < huge(1.0_wp)) frame%displacement = frame%displacement + way*direction
  end subroutine rest_on_sheet

  !> Smallest gap between points of the tool that face the sheet, or points of the sheet that face
  !! the tool, and the other; huge where neither lies above the other. And the shortest way from
  !! the sheet to the tool.
  subroutine find_gap(tool, points, sheet, frame, target, gap, place, away)
    type(tool_t), intent(in) :: tool
    type(tool_point_t), intent(in) :: points(:), sheet(:)
    type(frame_t), intent(in) :: frame
    type(sheet_target_t), intent(in) :: target
    real(wp), intent(out) :: gap              !! [length]
    real(wp), intent(out) :: place(3)         !! where it is
    real(wp), intent(out) :: away(3)          !! [length]
    type(hit_t) :: hit
    real(wp) :: x(3), distance
    integer :: i

    gap = huge(1.0_wp)
    distance = huge(1.0_wp)
    place = 0.0_wp
    away = 0.0_wp
    do i = 1, size(points)
      x = in_space(frame, points(i)%x)
      call search_all_faces(target%surface, x, hit)
      if (hit%distance < distance) then
        distance = hit%distance
        away = x - foot(target%surface, hit)
      end if
      if (is_beside(target%surface, hit, 0.0_wp)) cycle
      if (dot_product(matmul(frame%rotation, points(i)%normal), hit%normal) >= 0.0_wp) cycle
      call keep_least(hit%gap, x)
    end do
    do i = 1, size(sheet)
      call search_all_faces(tool, in_tool(frame, sheet(i)%x), hit)
      if (hit%distance < distance) then
        distance = hit%distance
        away = in_space(frame, foot(tool, hit)) - sheet(i)%x
      end if
      if (is_beside(tool, hit, 0.0_wp)) cycle
      if (dot_product(matmul(frame%rotation, hit%normal), sheet(i)%normal) >= 0.0_wp) cycle
      call keep_least(hit%gap, sheet(i)%x)
    end do
  contains

    !> A point far behind belongs to another side of the tool.
    subroutine keep_least(candidate, at)
      real(wp), intent(in) :: candidate, at(3)

      if (candidate >= gap .or. candidate < -3*target%thickness) return
      gap = candidate
      place = at
    end subroutine keep_least

  end subroutine find_gap

  !> The point that a search has found.
  pure function foot(tool, hit) result(x)
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: hit
    real(wp) :: x(3)

    x = face_position(tool%coefficients, hit%face, hit%at)
  end function foot

  !> Between a position where the tool is clear and one where it is in the sheet, the one where
  !! they touch. Rotations are not halved: the later position stands for the touch then.
  subroutine step_back(tool, points, sheet, before, target, frame, gap, place)
    type(tool_t), intent(in) :: tool
    type(tool_point_t), intent(in) :: points(:), sheet(:)
    type(frame_t), intent(in) :: before
    type(sheet_target_t), intent(in) :: target
    type(frame_t), intent(inout) :: frame
    real(wp), intent(out) :: gap, place(3)
    type(frame_t) :: clear, inside
    real(wp) :: away(3)
    integer :: i

    clear = before
    inside = frame
    do i = 1, n_halvings
      frame%displacement = 0.5_wp*(clear%displacement + inside%displacement)
      frame%time = 0.5_wp*(clear%time + inside%time)
      call find_gap(tool, points, sheet, frame, target, gap, place, away)
      if (abs(gap) <= touch*target%thickness) return
      if (gap > 0.0_wp) clear = frame
      if (gap < 0.0_wp) inside = frame
    end do
    gap = 0.0_wp
  end subroutine step_back

  !> At the start: whether the sheet lies behind the tool, and whether its face looks away from it.
  !! Of points halfway through the sheet those count that are nearest to the tool and not beside it.
  subroutine find_sides(tool, frame, sheet, target, approach)
    type(tool_t), intent(in) :: tool
    type(frame_t), intent(in) :: frame
    type(tool_point_t), intent(in) :: sheet(:)
    type(sheet_target_t), intent(in) :: target
    type(approach_t), intent(inout) :: approach
    type(hit_t) :: hits(size(sheet))
    logical :: is_near(size(sheet))
    real(wp) :: least
    integer :: i

    do i = 1, size(sheet)
      call search_all_faces(tool, in_tool(frame, sheet(i)%x - 0.5_wp*target%thickness &
                                          *sheet(i)%normal), hits(i))
      if (is_beside(tool, hits(i), 0.0_wp)) hits(i)%distance = huge(1.0_wp)
    end do
    least = minval(hits%distance)
    if (least >= huge(1.0_wp)) return
    is_near = hits%distance <= least + target%thickness
    approach%is_behind = all(pack(hits%gap, is_near) < 0.0_wp)
    approach%is_averted = all(pack([(dot_product(matmul(frame%rotation, hits(i)%normal), &
                                                 sheet(i)%normal), i=1, size(sheet))], &
                                   is_near) > flat)
  end subroutine find_sides

  !> Where an edge of the tool, flat on the sheet, touches it inside its outline.
  subroutine check_border(border, frame, gap, target, edges)
    type(tool_point_t), intent(in) :: border(:)
    type(frame_t), intent(in) :: frame
    real(wp), intent(in) :: gap               !! of the nearest point of the tool [length]
    type(sheet_target_t), intent(in) :: target
    type(edge_t), intent(inout) :: edges(:)
    type(hit_t) :: hit
    real(wp) :: x(3), overhang
    integer :: i

    do i = 1, size(border)
      x = in_space(frame, border(i)%x)
      call search_all_faces(target%surface, x, hit)
      if (hit%gap > gap + near*target%thickness) cycle
      if (dot_product(matmul(frame%rotation, border(i)%normal), hit%normal) > -flat) cycle
      overhang = length_along(target%surface, x, matmul(frame%rotation, border(i)%outward), &
                              target%thickness)
      if (overhang > edges(i)%overhang) edges(i) = edge_t(overhang, x, &
        matmul(frame%rotation, border(i)%outward), matmul(frame%rotation, border(i)%normal), &
        frame%time)
    end do
  end subroutine check_border

end module approach
