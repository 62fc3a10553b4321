!> Contact pairs of the scene as effects of the model, and whether the elements of the blank follow
!! the radii of its tools.
module contact_setup
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: origin_t, error_list_t, add_error, add_warning, n_errors
  use text, only: to_text, rounded_text, place_text
  use scene, only: scene_t, contact_spec_t, blank_spec_t
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use nurbs_solid, only: face_axes
  use secondary_surface, only: secondary_surface_t, new_secondary_surface, points_gauss, &
                               points_knot, points_greville
  use contact, only: contact_options_t, new_contact
  use start_gaps, only: initial_gap, face_gaps
  use element, only: element_t
  use blank, only: face_slice, blank_t
  use contact_effect, only: contact_effect_t, contact_view_t, contact_pairs, net_of_pair, &
                            trim_pair, trim_surface, face_mass
  use face_penetration, only: new_depth_samples, find_deepest
  use contact_fields, only: new_contact_fields
  use surface_grid, only: element_size_of, lines
  use tool, only: tool_t
  use tool_setup, only: sheet_thickness
  use effect, only: add_effect
  use model, only: model_t, increment_limit
  use knot_vector, only: n_spans
  use tool_bends, only: bend_t, tool_bends_below, elements_on_radius
  implicit none
  private

  public :: add_contact

  character(8), parameter :: face_names(6) = ["XI_MIN  ", "XI_MAX  ", "ETA_MIN ", "ETA_MAX ", &
                                              "ZETA_MIN", "ZETA_MAX"]

  integer, parameter :: first_large = 5         !! faces from here on are the large ones
  integer, parameter :: most_elements = 20000   !! looked at; of more every n-th

  !> An element of a face of the blank.
  type :: span_t
    real(wp) :: x(3) = 0.0_wp          !! its middle [length]
    real(wp) :: way(3, 2) = 0.0_wp     !! unit vectors along its two directions
    real(wp) :: size(2) = 0.0_wp       !! length along them [length]
  end type span_t

contains

  !> Append one pair to the force stage for each patch whose face is not joined to another. A blank
  !! that starts inside the tool is an error.
  subroutine add_contact(scene, spec, model, errors)
    type(scene_t), intent(in) :: scene
    type(contact_spec_t), intent(in) :: spec
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(contact_spec_t) :: pair
    integer :: face, p, before

    face = spec%face
    if (face == 0) face = facing_face(spec, model)
    if (face == 0) then
      call add_error(errors, spec%origin, "tool '"//model%bodies%tools(spec%tool)%name// &
                     "', which lies next to the blank", "a tool that faces the blank, or a FACE")
      return
    end if
    if (.not. model%bodies%blank%parts(1)%element%can_touch(face)) then
      call add_error(errors, spec%origin, "FACE="//trim(face_names(face))//", an edge of a shell", &
                     "ZETA_MIN or ZETA_MAX")
      return
    end if
    if (face < first_large .and. any(model%trims%step <= spec%last_step)) then
      call add_error(errors, spec%origin, "FACE="//trim(face_names(face))// &
                     ", an edge of a sheet with an outline", "ZETA_MIN or ZETA_MAX")
      return
    end if
    if (all([(scene%blank%patches(p)%is_joined(face), p=1, size(scene%blank%patches))])) then
      call add_error(errors, spec%origin, "FACE="//trim(face_names(face))// &
                     ", which is joined to another in every patch", "a face on the outside")
      return
    end if
    pair = spec
    if (point_kind(spec%points) /= points_gauss) pair%n_points = 0
    ! Points on either side of a strip would part its sides, which no strain holds together.
    where (face_axes(face) == scene%reduction%axis) pair%n_points = 1
    before = n_errors(errors)
    if (spec%last_step >= spec%first_step) call check_radii(model%bodies%blank, face, &
      findloc(face_axes(face), scene%reduction%axis, dim=1), model%bodies%tools(spec%tool), &
      scene%tools(spec%tool)%origin, scene%blank%is_shell, errors)
    do p = 1, size(scene%blank%patches)
      if (scene%blank%patches(p)%is_joined(face)) cycle
      call add_patch_contact(pair, scene%blank, p, face, scene%reduction%axis, model, errors)
      if (n_errors(errors) > before) return
    end do
  end subroutine add_contact

  !> The pair of one patch.
  subroutine add_patch_contact(spec, blank_spec, part, face, across, model, errors)
    type(contact_spec_t), intent(in) :: spec
    type(blank_spec_t), intent(in) :: blank_spec
    integer, intent(in) :: part, face
    integer, intent(in) :: across       !! axis of plane strain, 0: none
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(contact_effect_t) :: pair
    type(contact_options_t) :: options
    type(secondary_surface_t) :: secondary
    type(error_t), allocatable :: error
    integer :: bounds(3, 2)

    associate (tool => model%bodies%tools(spec%tool), &
               body => model%bodies%blank%parts(part)%element)
      call new_secondary_surface(secondary, body%surface(face), point_kind(spec%points), &
                             spec%n_points, error)
      if (allocated(error)) then
        call add_error(errors, spec%origin, error%message, "contact points that fit the blank")
        return
      end if
      call trim_surface(secondary, body)
      bounds = face_slice(body%grid%axes%n_basis, face)
      pair%name = "contact "//tool%name//" "//trim(face_names(face))
      if (size(blank_spec%patches) > 1) pair%name = pair%name//" "//body%name
      pair%tool = spec%tool
      pair%part = part
      pair%face = face
      pair%first_step = spec%first_step
      pair%given_step = spec%first_step
      pair%last_step = spec%last_step
      pair%lower = bounds(:, 1)
      pair%upper = bounds(:, 2)
      if (is_known(model, pair)) then
        call add_error(errors, spec%origin, "tool '"//tool%name//"' against "// &
                       trim(face_names(face))//" a second time", "one pair for a tool and a face")
        return
      end if
      pair%thickness = sheet_thickness(blank_spec)
      options = contact_options_t(scale=spec%penalty_scale, stiffness=spec%stiffness, &
        friction=spec%friction, damping=spec%damping, overhang=spec%overhang, &
        is_corner_start=spec%is_corner_start, is_late=spec%first_step > 1, &
        max_depth=pair%thickness)
      call new_contact(pair%pair, secondary, tool, face_mass(body, bounds, face), &
                       increment_limit(model), options, error)
      if (allocated(error)) then
        call add_error(errors, spec%origin, error%message, "usable contact options")
        return
      end if
      if (body%is_own_face(face)) allocate (pair%net, pair%net_force, source=pair%pair%motion%now)
      call new_depth_samples(pair%samples, pair%pair, tool, body%surface(face), pair%thickness, &
                             findloc(face_axes(face), across, dim=1))
      call trim_pair(pair, body)
      if (spec%first_step == 1) call check_start(spec, blank_spec%origin, model, pair, errors)
      if (model%output%has_pressure) then
        allocate (pair%fields)   ! on cells about as large as the elements of the face
        call new_contact_fields(pair%fields, pair%pair, tool, body%surface(face), face, &
                                point_kind(spec%points), spec%n_points, &
                                element_size_of(body%surface(face)), model%output%has_wear)
      end if
    end associate
    call add_effect(model%forces, pair)
  end subroutine add_patch_contact

  !> Does the model have a pair of this tool and this face? Their penalties would add up.
  logical function is_known(model, pair)
    type(model_t), intent(in), target :: model
    type(contact_effect_t), intent(in) :: pair
    type(contact_view_t), allocatable :: others(:)
    integer :: i

    is_known = .false.
    others = contact_pairs(model%forces)
    do i = 1, size(others)
      associate (other => others(i)%pair)
        if (other%first_step > pair%last_step .or. other%last_step < pair%first_step) cycle
        is_known = is_known .or. (other%tool == pair%tool .and. other%part == pair%part .and. &
                                  other%face == pair%face)
      end associate
    end do
  end function is_known

  pure integer function point_kind(name)
    character(*), intent(in) :: name

    point_kind = points_gauss
    if (name == "KNOT") point_kind = points_knot
    if (name == "GREVILLE") point_kind = points_greville
  end function point_kind

  !> Of the two large faces the one that is nearer to the tool; 0 where the tool faces neither.
  integer function facing_face(spec, model) result(face)
    type(contact_spec_t), intent(in) :: spec
    type(model_t), intent(in) :: model
    real(wp) :: mean(2)
    integer :: side

    do side = 1, 2
      mean(side) = mean_gap(spec, model, side + 4)
    end do
    face = merge(5, 6, mean(1) <= mean(2))
    if (minval(mean) >= huge(1.0_wp)) face = 0
  end function facing_face

  !> Mean gap between a face and the tool where they face each other; huge where they do not.
  real(wp) function mean_gap(spec, model, face) result(mean)
    type(contact_spec_t), intent(in) :: spec
    type(model_t), intent(in) :: model
    integer, intent(in) :: face
    type(nurbs_surface_t) :: surface
    type(secondary_surface_t) :: secondary
    type(error_t), allocatable :: error
    real(wp), allocatable :: gaps(:)
    logical, allocatable :: is_proper(:)
    real(wp) :: total
    integer :: p, n

    mean = huge(1.0_wp)
    total = 0.0_wp
    n = 0
    do p = 1, size(model%bodies%blank%parts)
      surface = model%bodies%blank%parts(p)%element%surface(face)
      call new_secondary_surface(secondary, surface, points_greville, [0, 0], error)
      if (allocated(error)) return
      if (allocated(gaps)) deallocate (gaps, is_proper)
      allocate (gaps(secondary%n_points), is_proper(secondary%n_points))
      call face_gaps(secondary, model%bodies%tools(spec%tool), surface%points, gaps, is_proper)
      total = total + sum(gaps, mask=is_proper)
      n = n + count(is_proper)
    end do
    if (n > 0) mean = total/n
  end function mean_gap

  !> The blank must not start inside the tool.
  subroutine check_start(spec, blank_origin, model, pair, errors)
    type(contact_spec_t), intent(in) :: spec
    type(origin_t), intent(in) :: blank_origin
    type(model_t), intent(in) :: model
    type(contact_effect_t), intent(inout) :: pair
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: small = 1.0e-3_wp   ! of the thickness, that is not worth a word
    real(wp), parameter :: far = 0.1_wp        ! of it, that no tool is meant to be
    real(wp), allocatable :: net(:, :, :)
    real(wp) :: gap, position(3)
    character(:), allocatable :: found
    integer :: point

    call net_of_pair(pair, model%bodies%blank%parts, net)
    associate (tool => model%bodies%tools(spec%tool))
      call initial_gap(pair%pair%secondary, tool, net, gap, point, position)
      call find_deepest(pair%samples, pair%pair, tool, net, tool%displacement, pair%deepest)
      found = "a blank (line "//to_text(blank_origin%line)//") that starts inside tool '"// &
              tool%name//"', at "
      ! Round-off of a blank that starts exactly touching is not a penetration.
      if (gap < -1.0e-9_wp*tool%search_distance) then
        call add_error(errors, spec%origin, found//place_text(position)//" by "// &
                       rounded_text(-gap), &
                       "a blank outside of all tools; if the side is wrong, change SIDE of the "// &
                       "tool, or of an offset the sign of its distance")
        return
      end if
      associate (x => pair%deepest%x, depth => pair%deepest%depth)
        found = found//place_text(x)//" by "//rounded_text(depth)// &
                ", where no contact point sees it"
      end associate
      if (pair%deepest%depth > far*pair%thickness) then
        call add_error(errors, spec%origin, found, "a blank outside of all tools")
      else if (pair%deepest%depth > small*pair%thickness) then
        call add_warning(errors, spec%origin, found, "a blank outside of all tools, or "// &
                         "elements and contact points (COUNT) as fine as the tool's shape")
      end if
    end associate
  end subroutine check_start

  !> Warn where a tool bends towards the sheet with a radius that is shorter than three of the
  !! elements nearest to it, measured along the bend. Bends that look away from the sheet do not
  !! count.
  subroutine check_radii(blank, face, across, tool, origin, is_shell, errors)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: face            !! of the blank against the tool
    integer, intent(in) :: across          !! direction along which a strip does not change, 0: none
    type(tool_t), intent(in) :: tool
    type(origin_t), intent(in) :: origin   !! of the warning
    logical, intent(in) :: is_shell        !! of the elements
    type(error_list_t), intent(inout) :: errors
    type(span_t), allocatable :: elements(:)
    type(bend_t), allocatable :: bends(:)
    type(bend_t) :: worst
    character(:), allocatable :: found, expected
    real(wp), parameter :: alike = 1.0e-3_wp
    real(wp) :: ratio, least, size_along, size_there, distance, nearest
    integer :: i

    elements = elements_of(blank, face, across)
    call tool_bends_below(tool, elements_on_radius*maxval([(maxval(elements(i)%size), &
                                                            i=1, size(elements))]), bends)
    least = elements_on_radius*(1.0_wp - alike)
    nearest = huge(1.0_wp)
    size_there = 0.0_wp
    do i = 1, size(bends)
      call find_element(elements, bends(i), tool%displacement, size_along, distance)
      if (.not. size_along > 0.0_wp) cycle
      ratio = bends(i)%radius/size_along
      ! Of places that bend alike the nearest is told.
      if (ratio > least*(1.0_wp + alike)) cycle
      if (ratio >= least*(1.0_wp - alike) .and. distance >= nearest) cycle
      least = min(ratio, least)
      nearest = distance
      worst = bends(i)
      size_there = size_along
    end do
    if (.not. size_there > 0.0_wp) return
    expected = "a radius of three elements: between contact points an edge goes unseen"
    if (worst%radius > 0.0_wp) expected = "elements of at most "// &
      rounded_text(worst%radius/elements_on_radius)//" there, a third of the radius"
    if (worst%radius > 0.0_wp .and. is_shell) &
      expected = expected//"; longer shells take too much force to bend over it"
    found = "a sharp edge"
    if (worst%radius > 0.0_wp) found = "the radius "//rounded_text(worst%radius)
    call add_warning(errors, origin, "tool '"//tool%name//"' with "//found//" at "// &
                     place_text(worst%x + tool%displacement)//", where the elements are "// &
                     rounded_text(size_there)//" long", expected)
  end subroutine check_radii

  !> Length along a bend of the element nearest to it, 0 where the bend looks away from it, and how
  !! far away its middle is.
  pure subroutine find_element(elements, bend, shift, length, distance)
    type(span_t), intent(in) :: elements(:)
    type(bend_t), intent(in) :: bend
    real(wp), intent(in) :: shift(3)       !! of the tool [length]
    real(wp), intent(out) :: length, distance   !! [length]
    real(wp) :: squares(size(elements))
    integer :: i

    squares = [(sum((elements(i)%x - bend%x - shift)**2), i=1, size(elements))]
    length = 0.0_wp
    distance = sqrt(minval(squares))
    associate (element => elements(minloc(squares, 1)))
      if (sum((element%x - bend%x - shift)*bend%normal) <= 0.0_wp) return
      i = maxloc(abs(matmul(bend%direction, element%way)), 1)
      length = element%size(i)
    end associate
  end subroutine find_element

  !> The elements of a face of all patches where it is not joined to another.
  function elements_of(blank, face, across) result(elements)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: face, across
    type(span_t), allocatable :: elements(:)
    type(nurbs_surface_t) :: surface
    integer :: p

    allocate (elements(0))
    do p = 1, size(blank%parts)
      surface = blank%parts(p)%element%surface(face)
      elements = [elements, elements_of_surface(surface, across)]
    end do
    p = (size(elements) + most_elements - 1)/most_elements
    elements = elements(::p)
  end function elements_of

  !> The elements of a surface.
  function elements_of_surface(surface, across) result(elements)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: across
    type(span_t), allocatable :: elements(:)
    real(wp), allocatable :: xi(:), eta(:)
    real(wp) :: d1(3, 2)
    integer :: i, j, n, d

    xi = lines(surface%axes(1), 2)
    eta = lines(surface%axes(2), 2)
    allocate (elements(n_spans(surface%axes(1))*n_spans(surface%axes(2))))
    n = 0
    do j = 2, size(eta), 2
      do i = 2, size(xi), 2
        n = n + 1
        associate (element => elements(n))
          call evaluate_surface(surface, [xi(i), eta(j)], element%x, d1)
          element%size = norm2(d1, 1)*[xi(i + 1) - xi(i - 1), eta(j + 1) - eta(j - 1)]
          do d = 1, 2
            if (d /= across) element%way(:, d) = d1(:, d)/max(norm2(d1(:, d)), tiny(1.0_wp))
          end do
        end associate
      end do
    end do
  end function elements_of_surface

end module contact_setup
