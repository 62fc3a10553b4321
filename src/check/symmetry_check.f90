!> Planes of symmetry of the blank that do not fit its faces or the tools: faces across another
!! axis; tools that cross a plane and are not symmetric to it or move across it, that lie beyond it,
!! and that end a little before it.
module symmetry_check
  use kinds, only: wp
  use text, only: rounded_text, place_text, axis_names
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t
  use support_extent, only: extent_t, extent_of, is_across, held_ends, find_box
  use model, only: model_t
  use tool, only: tool_t
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  use sheet_target, only: sheet_target_t, new_sheet_target, is_over
  use sweep, only: frame_t, in_space, in_tool
  use tool_points, only: tool_point_t, inner_points, border_points
  use approach, only: edge_t
  use reach_check, only: encounter_t, is_followed
  implicit none
  private

  public :: check_symmetry, check_symmetry_names

  real(wp), parameter :: exact = 0.1_wp       !! distance, of the thickness, that counts as none
  real(wp), parameter :: few = 3.0_wp         !! thicknesses that a tool ends before a plane ...
  real(wp), parameter :: part = 0.05_wp       !! ... or part of the length of the blank: suspicious
  real(wp), parameter :: toward = 0.9_wp      !! cosine of a direction that runs to the plane
  real(wp), parameter :: aside = 1.0e-3_wp    !! cosine of a motion that still runs along the plane

  !> A plane of symmetry across a coordinate.
  type :: plane_t
    integer :: c = 0                          !! the coordinate
    real(wp) :: at = 0.0_wp                   !! where along it [length]
    integer :: side = 0                       !! +1: the blank lies at higher values, -1: at lower
    real(wp) :: length = 0.0_wp               !! of the blank along it [length]
  end type plane_t

contains

  !> Planes at one end of the blank, whose other end is free: what is held at both ends, or along
  !! the plane too, may be a clamp.
  function planes_of(scene) result(planes)
    type(scene_t), intent(in) :: scene
    type(plane_t), allocatable :: planes(:)
    real(wp) :: bounds(3, 2)
    logical :: is_plane(2), is_clamped(2)
    integer :: c, i, end

    allocate (planes(0))
    call find_box(scene, bounds(:, 1), bounds(:, 2))
    do c = 1, 3
      is_plane = held_ends(scene, c, c)
      if (count(is_plane) /= 1) cycle
      is_clamped = .true.
      do i = 1, 3
        if (i /= c) is_clamped = is_clamped .and. held_ends(scene, i, c)
      end do
      end = findloc(is_plane, .true., 1)
      if (.not. is_clamped(end)) planes = [planes, plane_t(c, bounds(c, end), 3 - 2*end, &
                                                          bounds(c, 2) - bounds(c, 1))]
    end do
  end function planes_of

  !> Warn of tools that do not fit the planes. Edges that end before one are reported here, and
  !! taken from the edges inside the outline of the blank.
  subroutine check_symmetry(scene, model, encounters, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(inout) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    type(plane_t), allocatable :: planes(:)
    type(sheet_target_t) :: target
    integer :: i, p

    planes = planes_of(scene)
    do p = 1, size(planes)
      do i = 1, size(encounters)
        if (target%face /= encounters(i)%face) &
          call new_sheet_target(model%bodies%blank, encounters(i)%face, thickness, target)
        call check_mirror(scene, model, encounters(i), planes(p), target, errors)
        call check_side(scene, model, encounters(i), planes(p), thickness, errors)
        call check_end(scene, model, encounters, i, planes(p), target, errors)
      end do
    end do
  end subroutine check_symmetry

  !> Warn of XSYMM, YSYMM and ZSYMM on a face of the blank that is flat across another axis: that
  !! holds the motion along the face. Only faces on the edge of the blank are seen, not the large
  !! ones.
  subroutine check_symmetry_names(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: words(3) = ["XSYMM", "YSYMM", "ZSYMM"]
    type(extent_t) :: extent
    integer :: i, c, across

    do i = 1, size(scene%boundaries)
      associate (boundary => scene%boundaries(i))
        c = findloc(words == boundary%word, .true., 1)
        ! Later ones may be supports of the released part.
        if (c == 0 .or. boundary%first_step > 1) cycle
        extent = extent_of(scene, boundary%set)
        across = findloc([is_across(extent, 1), is_across(extent, 2), is_across(extent, 3)], &
                         .true., 1)
        if (across == 0 .or. is_across(extent, c)) cycle
        call add_warning(errors, boundary%origin, words(c)//" of the set "// &
                         scene%sets(boundary%set)%name//", a plane face with the normal "// &
                         axis_names(across), words(across)//", which holds the motion across it")
      end associate
    end do
  end subroutine check_symmetry_names

  !> Warn of a tool that lies beyond a plane as a whole, or that the plane cuts and that moves
  !! across it: its mirror would move the other way.
  subroutine check_side(scene, model, encounter, plane, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    type(plane_t), intent(in) :: plane
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    type(frame_t) :: frame
    real(wp), allocatable :: distances(:)
    integer :: i, k

    frame = frame_of(encounter)
    associate (tool => model%bodies%tools(encounter%tool), name => scene%tools(encounter%tool)%name)
      associate (points => border_points(tool))
        distances = [(away(plane, in_space(frame, points(i)%x)), i=1, size(points))]
      end associate
      associate (points => inner_points(tool))
        distances = [distances, (away(plane, in_space(frame, points(i)%x)), i=1, size(points))]
      end associate
      if (maxval(distances) < exact*thickness .and. minval(distances) < -exact*thickness) then
        call add_warning(errors, scene%tools(encounter%tool)%origin, "the tool '"//name// &
          "', which lies beyond the plane of symmetry "//name_of(plane)//" of the blank", &
          "a tool on the side of the blank")
      else if (minval(distances) < exact*thickness) then
        do k = 1, size(scene%motions)
          associate (motion => scene%motions(k))
            if (motion%tool /= encounter%tool .or. motion%is_rotation) cycle
            if (abs(motion%vector(plane%c)) <= aside*norm2(motion%vector)) cycle
            call add_warning(errors, motion%origin, "a motion of the tool '"//name// &
              "' along "//axis_names(plane%c)//", across the plane of symmetry "// &
              name_of(plane)//" of the blank, which cuts the tool", "a motion along the plane, "// &
              "or a blank without this symmetry")
          end associate
        end do
      end if
    end associate
  end subroutine check_side

  !> Where a tool is compared with the planes: where it touches first, else nearest.
  pure function frame_of(encounter) result(frame)
    type(encounter_t), intent(in) :: encounter
    type(frame_t) :: frame

    frame = encounter%approach%nearest
    if (encounter%approach%has_touched) frame = encounter%approach%first
  end function frame_of

  !> The mirror of what lies beyond the plane must lie on the tool, above the blank.
  subroutine check_mirror(scene, model, encounter, plane, target, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    type(plane_t), intent(in) :: plane
    type(sheet_target_t), intent(in) :: target
    type(error_list_t), intent(inout) :: errors
    type(tool_point_t), allocatable :: points(:)
    type(frame_t) :: frame
    type(hit_t) :: hit
    real(wp) :: x(3), mirrored(3), worst, place(3)
    logical :: is_crossing
    integer :: i

    worst = exact*target%thickness
    is_crossing = .false.
    frame = frame_of(encounter)
    associate (tool => model%bodies%tools(encounter%tool))
      points = [inner_points(tool), border_points(tool)]
      do i = 1, size(points)
        x = in_space(frame, points(i)%x)
        is_crossing = is_crossing .or. away(plane, x) > exact*target%thickness
        if (away(plane, x) > -exact*target%thickness) cycle
        mirrored = x
        mirrored(plane%c) = 2*plane%at - x(plane%c)
        call search_all_faces(tool, in_tool(frame, mirrored), hit)
        if (hit%distance <= worst .or. is_beside(tool, hit, 0.0_wp)) cycle
        if (.not. is_over(target, mirrored)) cycle
        worst = hit%distance
        place = x
      end do
    end associate
    if (is_crossing .and. worst > exact*target%thickness) call add_warning(errors, &
      scene%tools(encounter%tool)%origin, "the tool '"//scene%tools(encounter%tool)%name// &
      "', which crosses the plane of symmetry "//name_of(plane)//" and is not symmetric to it: "// &
      "the mirror of "//place_text(place)//" is "//rounded_text(worst)//" away from the tool", &
      "a tool that is symmetric to the plane or ends there")
  end subroutine check_mirror

  !> Edges that run along the plane a little before it, with no tool between, leave a gap.
  subroutine check_end(scene, model, encounters, i, plane, target, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(inout) :: encounters(:)
    integer, intent(in) :: i
    type(plane_t), intent(in) :: plane
    type(sheet_target_t), intent(in) :: target
    type(error_list_t), intent(inout) :: errors
    type(tool_point_t), allocatable :: border(:)
    type(frame_t) :: frame
    type(edge_t) :: edge
    real(wp) :: gaps(2)                       ! least and greatest [length]
    logical, allocatable :: is_end(:)
    integer :: k

    border = border_points(model%bodies%tools(encounters(i)%tool))
    frame = frame_of(encounters(i))
    gaps = [huge(1.0_wp), 0.0_wp]
    allocate (is_end(size(border)), source=.false.)
    do k = 1, size(border)
      edge%x = in_space(frame, border(k)%x)
      edge%outward = matmul(frame%rotation, border(k)%outward)
      edge%normal = matmul(frame%rotation, border(k)%normal)
      edge%time = frame%time
      edge%overhang = away(plane, edge%x)
      if (plane%side*edge%outward(plane%c) > -toward .or. edge%overhang < 0.0_wp .or. &
          edge%overhang > max(few*target%thickness, part*plane%length)) cycle
      gaps = [min(gaps(1), edge%overhang), max(gaps(2), edge%overhang)]
      is_end(k) = is_over(target, edge%x)
      if (is_end(k)) is_end(k) = .not. is_followed(model, encounters, i, edge)
    end do
    if (gaps(2) - gaps(1) > exact*target%thickness .or. gaps(1) <= exact*target%thickness .or. &
        .not. any(is_end)) return
    where (is_end) encounters(i)%approach%edges%overhang = 0.0_wp
    call add_warning(errors, scene%tools(encounters(i)%tool)%origin, "the tool '"// &
      scene%tools(encounters(i)%tool)%name//"', which ends "//rounded_text(gaps(1))// &
      " before the plane of symmetry "//name_of(plane), &
      "a tool that reaches the plane or extends beyond it")
  end subroutine check_end

  !> Distance from the plane, on the side of the blank positive.
  pure real(wp) function away(plane, x)
    type(plane_t), intent(in) :: plane
    real(wp), intent(in) :: x(3)

    away = plane%side*(x(plane%c) - plane%at)
  end function away

  pure function name_of(plane) result(name)
    type(plane_t), intent(in) :: plane
    character(:), allocatable :: name

    name = axis_names(plane%c)//" = "//rounded_text(plane%at)
  end function name_of

end module symmetry_check
