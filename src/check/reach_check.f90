!> Whether tools come to the blank and lie on it as tools should: tools that never reach it or move
!! away from it, tools behind whose surface it lies, faces that look away from their tool, and
!! edges of tools that touch the sheet inside its outline.
module reach_check
  use kinds, only: wp
  use text, only: rounded_text, place_text
  use input_errors, only: origin_t, error_list_t, add_warning, add_error, has_error_at
  use scene, only: scene_t
  use model, only: model_t
  use contact_effect, only: contact_view_t, contact_pairs
  use nurbs_surface, only: nurbs_surface_t
  use tool, only: tool_t
  use tool_clearance_search, only: clearance_search_t, new_clearance_search, find_clearance
  use sheet_target, only: sheet_target_t, new_sheet_target
  use sweep, only: frame_t, path_t, path_of, position_at, in_tool, moved_by
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  use approach, only: approach_t, edge_t, find_approach, rest_on_sheet
  use travel, only: blank_reach, force_motion, is_formed_by_strokes
  implicit none
  private

  public :: check_reach, encounter_t, encounters_of, is_followed, identity

  !> A tool against a face of the blank, and how it comes there.
  type :: encounter_t
    integer :: tool = 0
    integer :: face = 0
    integer :: first_step = 1, last_step = huge(1)   !! of the deck, in which they may touch
    type(origin_t) :: origin                  !! of the *CONTACT PAIR
    type(path_t) :: path
    real(wp) :: way = 0.0_wp                  !! of a tool that a force moves, to the sheet [length]
    logical :: is_beside = .false.            !! a force moves the tool past the blank
    type(approach_t) :: approach
  end type encounter_t

contains

  !> Follow all tools of contact pairs on their way to the blank that lies as at the start.
  function encounters_of(scene, model, thickness) result(encounters)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in), target :: model
    real(wp), intent(in) :: thickness         !! [length]
    type(encounter_t), allocatable :: encounters(:)
    type(sheet_target_t) :: targets(6)
    type(contact_view_t), allocatable :: pairs(:)
    type(encounter_t) :: encounter
    integer :: i, k

    allocate (encounters(0))
    pairs = [contact_pairs(model%forces), contact_pairs(model%later_forces)]
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        if (any(encounters%tool == pair%tool .and. encounters%face == pair%face)) cycle
        if (pair%last_step < pair%first_step) cycle   ! removed before it acts
        associate (target => targets(pair%face), tool => model%bodies%tools(pair%tool))
          if (target%face == 0) call new_sheet_target(model%bodies%blank, pair%face, thickness, &
                                                      target)
          if (target%face == 0) cycle
          encounter%tool = pair%tool
          encounter%face = pair%face
          encounter%first_step = pair%first_step
          encounter%last_step = pair%last_step
          encounter%origin = scene%contacts(spec_of(scene, pair%tool, pair%face))%origin
          encounter%path = path_of(model, pair%tool)
          encounter%way = 0.0_wp
          encounter%is_beside = .false.
          k = force_motion(scene, pair%tool)
          if (k > 0 .and. encounter%path%is_still) call lower_to_sheet(scene%motions(k)%vector, &
                                                                     tool, target, encounter)
          call find_approach(tool, path_until(encounter%path, pair%last_step), target, &
                             encounter%approach)
        end associate
      end associate
      encounters = [encounters, encounter]
    end do
  end function encounters_of

  !> A path that ends with a step, in which its tool is removed.
  pure function path_until(path, last_step) result(part)
    type(path_t), intent(in) :: path
    integer, intent(in) :: last_step
    type(path_t) :: part

    part = path
    if (last_step < size(path%starts)) part%end_time = path%starts(last_step + 1)%time
  end function path_until

  !> The *CONTACT PAIR of a tool and a face, given or found.
  pure integer function spec_of(scene, tool, face) result(k)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: tool, face

    k = findloc(scene%contacts%tool == tool .and. scene%contacts%face == face, .true., dim=1)
    if (k == 0) k = findloc(scene%contacts%tool == tool .and. scene%contacts%face == 0, .true., &
                            dim=1)
    if (k == 0) k = findloc(scene%contacts%tool, tool, dim=1)
  end function spec_of

  !> Put a tool where its force brings it to rest on the blank.
  subroutine lower_to_sheet(force, tool, target, encounter)
    real(wp), intent(in) :: force(3)
    type(tool_t), intent(in) :: tool
    type(sheet_target_t), intent(in) :: target
    type(encounter_t), intent(inout) :: encounter
    real(wp) :: direction(3)
    logical :: is_found

    direction = force/max(norm2(force), tiny(1.0_wp))
    call rest_on_sheet(tool, direction, target, position_at(encounter%path, 0.0_wp), &
                       encounter%way, is_found)
    encounter%is_beside = .not. is_found
    if (is_found) encounter%path%shift = encounter%way*direction
  end subroutine lower_to_sheet

  !> Report what is wrong with the encounters of a scene.
  subroutine check_reach(scene, model, encounters, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    logical :: are_leaving
    integer :: i

    are_leaving = do_all_leave(scene, model, encounters, thickness)
    do i = 1, size(encounters)
      associate (encounter => encounters(i), approach => encounters(i)%approach, &
                 tool => model%bodies%tools(encounters(i)%tool))
        if (has_error_at(errors, encounter%origin)) cycle
        if (is_edge_face(scene, encounter%face, thickness)) call add_warning(errors, &
          encounter%origin, "a face of the blank that is an edge of the sheet, under the tool '"// &
          tool%name//"'", "a large face, or no FACE: the one that faces the tool is then chosen")
        if (encounter%first_step == 1 .and. approach%is_behind) then
          call add_error(errors, scene%tools(encounter%tool)%origin, "the tool '"//tool%name// &
                         "', behind whose surface the blank lies, "// &
                         rounded_text(approach%at_start)//" away", "the other SIDE")
          cycle
        end if
        if (encounter%first_step == 1 .and. approach%is_averted) call add_warning(errors, &
          encounter%origin, "a face of the blank that looks away from the tool '"//tool%name//"'", &
          "the opposite FACE, or no FACE: the one that faces the tool is then chosen")
        call check_edges(scene, model, encounters, i, errors)
        call check_distance(scene, model, encounters, i, thickness, are_leaving, errors)
      end associate
    end do
  end subroutine check_reach

  !> Does a sheet have other faces far closer together than this one and the opposite one?
  pure logical function is_edge_face(scene, face, thickness)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: face
    real(wp), intent(in) :: thickness         !! [length]
    real(wp), parameter :: thin = 5.0_wp
    real(wp) :: x(3, 2)
    integer :: p

    is_edge_face = size(scene%blank%patches) > 0
    do p = 1, size(scene%blank%patches)
      associate (points => scene%blank%patches(p)%solid%points)
        x = 0.0_wp
        select case ((face + 1)/2)
        case (1); x = reshape([points(1, 1, 1, :), points(size(points, 1), 1, 1, :)], [3, 2])
        case (2); x = reshape([points(1, 1, 1, :), points(1, size(points, 2), 1, :)], [3, 2])
        end select
      end associate
      is_edge_face = is_edge_face .and. norm2(x(:, 2) - x(:, 1)) > thin*thickness
    end do
  end function is_edge_face

  !> Warn of the edge of a tool beyond which the blank extends farthest, without a tool that faces
  !! the same side of it there, as the punch does in the opening of a holder, or the same tool
  !! beyond a gap.
  subroutine check_edges(scene, model, encounters, i, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    integer, intent(in) :: i
    type(error_list_t), intent(inout) :: errors
    type(edge_t) :: worst
    integer :: k

    do k = 1, size(encounters(i)%approach%edges)
      associate (edge => encounters(i)%approach%edges(k))
        if (edge%overhang <= worst%overhang) cycle
        if (.not. is_followed(model, encounters, i, edge)) worst = edge
      end associate
    end do
    if (worst%overhang > 0.0_wp) call add_warning(errors, &
      scene%tools(encounters(i)%tool)%origin, "an edge of the tool '"// &
      scene%tools(encounters(i)%tool)%name//"' that touches the sheet at "// &
      place_text(worst%x)//", time "//rounded_text(worst%time)//": the blank extends "// &
      rounded_text(worst%overhang)//" beyond it", &
      "a tool that is larger than the blank, or whose edge turns away from it")
  end subroutine check_edges

  !> Does any tool on the same face of the blank lie above it, or touch it, where it extends beyond
  !! an edge of the tool of encounter i?
  logical function is_followed(model, encounters, i, edge)
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    integer, intent(in) :: i
    type(edge_t), intent(in) :: edge
    integer :: j

    is_followed = .false.
    do j = 1, size(encounters)
      if (encounters(j)%face /= encounters(i)%face .or. is_followed) cycle
      is_followed = faces(model%bodies%tools(encounters(j)%tool), &
                          position_at(encounters(j)%path, edge%time), edge)
      if (j /= i) is_followed = is_followed .or. touches_beyond(encounters(j)%approach, edge)
    end do
  end function is_followed

  !> Does a tool lie above the blank where it extends beyond an edge of another?
  logical function faces(tool, frame, edge)
    type(tool_t), intent(in) :: tool
    type(frame_t), intent(in) :: frame
    type(edge_t), intent(in) :: edge
    integer, parameter :: n_samples = 8
    real(wp), parameter :: alike = 0.5_wp    ! cosine between the two tools
    type(hit_t) :: hit
    integer :: k

    faces = .false.
    do k = 1, n_samples
      call search_all_faces(tool, in_tool(frame, edge%x + edge%overhang*k/n_samples*edge%outward), &
                            hit)
      faces = faces .or. (.not. is_beside(tool, hit, 0.0_wp) .and. &
                          dot_product(matmul(frame%rotation, hit%normal), edge%normal) > alike)
    end do
  end function faces

  !> Does another tool touch the blank where it extends beyond an edge? A sharp nose does so whose
  !! flanks are too steep to face the blank.
  pure logical function touches_beyond(approach, edge)
    type(approach_t), intent(in) :: approach
    type(edge_t), intent(in) :: edge
    real(wp) :: along

    along = dot_product(approach%contact - edge%x, edge%outward)
    touches_beyond = approach%has_touched .and. along > 0.0_wp .and. along <= edge%overhang
  end function touches_beyond

  !> Is a tool nowhere nearer to the blank at rest than at the start, and farther at the end?
  pure logical function is_leaving(approach)
    type(approach_t), intent(in) :: approach
    real(wp), parameter :: clearly = 1.0e-3_wp

    is_leaving = approach%is_leaving .and. .not. approach%nearest%time > 0.0_wp .and. &
                 approach%at_end - approach%at_start > clearly*approach%at_end
  end function is_leaving

  !> How far others carry the blank after a tool that leaves it: as far as they move, and twice as
  !! far where a tool on the same face is there to bend the blank over.
  real(wp) function push_of(scene, encounters, i) result(reach)
    type(scene_t), intent(in) :: scene
    type(encounter_t), intent(in) :: encounters(:)
    integer, intent(in) :: i
    integer, parameter :: n_samples = 32
    type(path_t) :: path
    type(frame_t) :: frame
    real(wp) :: far
    integer :: j, k

    associate (direction => encounters(i)%approach%toward_end)
      reach = blank_reach(scene, encounters(i)%tool, direction)
      if (any(scene%motions%is_force .or. scene%motions%is_rotation) .or. &
          .not. is_formed_by_strokes(scene)) return
      reach = 0.0_wp
      do j = 1, size(encounters)
        if (encounters(j)%tool == encounters(i)%tool) cycle
        if (any(encounters(:j - 1)%tool == encounters(j)%tool)) cycle
        path = path_until(encounters(j)%path, encounters(j)%last_step)
        far = 0.0_wp
        do k = 1, n_samples
          frame = position_at(path, k*path%end_time/n_samples)
          far = max(far, dot_product(frame%displacement - path%starts(1)%displacement, direction))
        end do
        reach = reach + far
      end do
      if (count(encounters%face == encounters(i)%face) > 1) reach = 2*reach
    end associate
  end function push_of

  !> Does a tool move as the deck says before it is removed?
  pure logical function does_move(tool, encounter, thickness)
    type(tool_t), intent(in) :: tool
    type(encounter_t), intent(in) :: encounter
    real(wp), intent(in) :: thickness         !! of the blank [length]
    integer, parameter :: n_samples = 16
    real(wp), parameter :: round_off = 1.0e-6_wp   ! of the thickness
    type(path_t) :: path
    type(frame_t) :: start
    integer :: k

    path = path_until(encounter%path, encounter%last_step)
    start = position_at(path, 0.0_wp)
    does_move = .false.
    do k = 1, n_samples
      if (path%is_still .or. does_move) exit
      does_move = moved_by(tool, start, position_at(path, k*path%end_time/n_samples)) &
                  > round_off*thickness
    end do
  end function does_move

  !> Is the blank held under a tool with a force for tools to form it, and is none pressed into it?
  !! Without a holder they may carry it by friction, as rolls do.
  pure logical function does_none_press(scene, encounters)
    type(scene_t), intent(in) :: scene
    type(encounter_t), intent(in) :: encounters(:)
    integer :: i

    does_none_press = is_formed_by_strokes(scene) .and. any(scene%motions%is_force)
    do i = 1, size(encounters)
      does_none_press = does_none_press .and. .not. encounters(i)%approach%is_pressed
    end do
  end function does_none_press

  !> Do all tools that move as the deck says leave the blank, which nothing else moves?
  pure logical function do_all_leave(scene, model, encounters, thickness)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
    integer :: i

    do_all_leave = is_formed_by_strokes(scene)
    do i = 1, size(encounters)
      do_all_leave = do_all_leave .and. (is_leaving(encounters(i)%approach) .or. &
        .not. does_move(model%bodies%tools(encounters(i)%tool), encounters(i), thickness))
    end do
  end function do_all_leave

  !> A tool that does not touch the blank at rest must be met by a blank that others carry.
  subroutine check_distance(scene, model, encounters, i, thickness, are_leaving, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    integer, intent(in) :: i
    real(wp), intent(in) :: thickness         !! of the blank [length]
    logical, intent(in) :: are_leaving        !! all tools that move
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: nearly = 0.9_wp
    character(:), allocatable :: found
    real(wp) :: away, reach

    if (force_motion(scene, encounters(i)%tool) > 0) return
    found = ""
    associate (encounter => encounters(i), tool => scene%tools(encounters(i)%tool), &
               approach => encounters(i)%approach)
      if (.not. approach%has_touched) then
        away = least_distance_of(model, encounter)
        reach = blank_reach(scene, encounter%tool, approach%toward)
        ! A tool that stands close to the sheet limits its motion.
        if (encounter%path%is_still .and. .not. approach%is_beside) reach = reach + thickness
        if (away > reach) found = "the tool '"//tool%name//"', which never reaches the blank: "// &
          trim(merge("it passes beside it, at", "it comes within        ", approach%is_beside))// &
          " "//rounded_text(away)
      end if
      if (found == "" .and. is_leaving(approach)) then
        if (are_leaving .or. approach%at_end - approach%at_start > &
            nearly*push_of(scene, encounters, i)) &
          found = "the tool '"//tool%name//"', which moves away from the blank"
      end if
      if (found == "" .and. does_none_press(scene, encounters) .and. &
          does_move(model%bodies%tools(encounter%tool), encounter, thickness)) &
        found = "the tool '"//tool%name//"', which moves and is never pressed into the blank, "// &
                "nor is another tool"
      if (found /= "") call add_warning(errors, tool%origin, found, &
                                        "a *TOOL MOTION towards the blank")
    end associate
  end subroutine check_distance

  !> Smallest distance of the tool and all of the blank at the position that sampled points found
  !! nearest.
  real(wp) function least_distance_of(model, encounter) result(distance)
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    type(clearance_search_t) :: search
    type(nurbs_surface_t) :: surfaces(size(model%bodies%blank%parts))
    real(wp) :: doubt
    integer :: p

    associate (parts => model%bodies%blank%parts, tool => model%bodies%tools(encounter%tool), &
               frame => encounter%approach%nearest)
      distance = encounter%approach%least
      if (any(abs(frame%rotation - identity()) > 0.0_wp)) return
      do p = 1, size(parts)
        surfaces(p) = parts(p)%element%surface(encounter%face)
      end do
      call new_clearance_search(search, surfaces, tool)
      call find_clearance(search, tool, frame%displacement, 0.0_wp, 0.0_wp, distance, doubt)
      distance = distance - doubt
    end associate
  end function least_distance_of

  pure function identity() result(matrix)
    real(wp) :: matrix(3, 3)
    integer :: i

    matrix = 0.0_wp
    do i = 1, 3
      matrix(i, i) = 1.0_wp
    end do
  end function identity

end module reach_check
