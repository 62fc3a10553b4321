!> What a deck names by parts of the sheet, for outlines and trims that cut these away.
module watch_setup
  use kinds, only: wp
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t, face_of_set, probe_spec_t
  use knot_vector, only: breaks
  use nurbs_solid, only: face_axes
  use element, only: element_t
  use blank, only: blank_t
  use face_quadrature, only: middle_in
  use outline_watch, only: watched_t, is_gone
  use boundary_setup, only: members_t, find_members
  implicit none
  private

  public :: list_watched, warn_of_gone, element_at

contains

  !> Supports, initial velocities, pressures and history points of a sheet of one patch.
  subroutine list_watched(scene, blank, watched)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(in) :: blank
    type(watched_t), allocatable, intent(out) :: watched(:)
    integer :: i

    allocate (watched(0))
    do i = 1, size(scene%boundaries)
      associate (spec => scene%boundaries(i))
        call add_set(scene, blank, spec%set, spec%last_step, watched)
        watched(size(watched))%origin = spec%origin
      end associate
    end do
    do i = 1, size(scene%initial_velocities)
      associate (spec => scene%initial_velocities(i))
        if (spec%set == 0) cycle
        call add_set(scene, blank, spec%set, 1, watched)
        watched(size(watched))%origin = spec%origin
      end associate
    end do
    do i = 1, size(scene%loads)
      if (scene%loads(i)%kind == "PRESSURE") call add_load(scene, i, watched)
    end do
    do i = 1, size(scene%probes)
      call add_probe(blank%parts(1)%element, scene%probes(i), watched)
    end do
  end subroutine list_watched

  !> Control points of a set.
  subroutine add_set(scene, blank, set, last_step, watched)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: set, last_step
    type(watched_t), allocatable, intent(inout) :: watched(:)
    type(members_t), allocatable :: members(:)
    type(watched_t) :: new

    new%what = "the set "//scene%sets(set)%name
    new%last_step = last_step
    call find_members(blank, scene%sets(set), members)
    new%points = any(members(1)%is_in, 3)
    watched = [watched, new]
  end subroutine add_set

  !> Elements of one of the large faces that a load acts on.
  subroutine add_load(scene, i, watched)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i
    type(watched_t), allocatable, intent(inout) :: watched(:)
    integer, parameter :: first_large = 5
    type(watched_t) :: new
    integer :: axes(2), face

    associate (spec => scene%loads(i), set => scene%sets(scene%loads(i)%set), &
               solid => scene%blank%patches(1)%solid)
      face = face_of_set(solid, set, 1)
      if (face < first_large) return
      axes = face_axes(face)
      new%origin = spec%origin
      new%what = "the set "//set%name
      new%last_step = spec%last_step
      associate (one => middle_in(solid%axes(1), set%lower(axes(1), 1), set%upper(axes(1), 1)), &
                 two => middle_in(solid%axes(2), set%lower(axes(2), 1), set%upper(axes(2), 1)))
        new%elements = spread(one, 2, size(two)) .and. spread(two, 1, size(one))
      end associate
      watched = [watched, new]
    end associate
  end subroutine add_load

  !> The element of a history point.
  subroutine add_probe(element, probe, watched)
    class(element_t), intent(in) :: element
    type(probe_spec_t), intent(in) :: probe
    type(watched_t), allocatable, intent(inout) :: watched(:)
    type(watched_t) :: new
    integer :: at(3)

    new%origin = probe%origin
    new%what = "the history point "//probe%name
    at = element_at(element, probe%xi)
    allocate (new%elements(element%n_elements(1), element%n_elements(2)), source=.false.)
    new%elements(at(1), at(2)) = .true.
    watched = [watched, new]
  end subroutine add_probe

  !> Number of the element of a place along the axes of a sheet.
  pure function element_at(element, xi) result(at)
    class(element_t), intent(in) :: element
    real(wp), intent(in) :: xi(3)
    integer :: at(3), a

    at = 1
    do a = 1, 2
      at(a) = min(max(count(breaks(element%grid%axes(a)) <= xi(a)), 1), element%n_elements(a))
    end do
  end function element_at

  !> Warn of what lies outside of the outline.
  subroutine warn_of_gone(blank, watched, errors)
    type(blank_t), intent(in) :: blank
    type(watched_t), intent(inout) :: watched(:)
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(watched)
      if (watched(i)%is_reported) cycle
      if (.not. is_gone(watched(i), blank%parts(1)%element)) cycle
      watched(i)%is_reported = .true.
      if (allocated(watched(i)%points)) call add_warning(errors, watched(i)%origin, &
        watched(i)%what//", which lies outside of the outline", &
        "a set of control points inside the outline")
    end do
  end subroutine warn_of_gone

end module watch_setup
