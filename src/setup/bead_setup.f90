!> Draw beads of the scene as effects of the model.
module bead_setup
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: rounded_text, place_text
  use linear_algebra, only: cross
  use tool, only: tool_t, new_tool
  use tool_face, only: separation_t, separation, unit_normal
  use tool_search, only: search_all_faces
  use closest_point, only: hit_t
  use scene, only: scene_t, bead_spec_t
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: face_side
  use secondary_surface, only: secondary_surface_t, new_secondary_surface, points_gauss
  use failure, only: error_t
  use motion_curve, only: curve_t
  use boundary_setup, only: curve_of
  use draw_bead, only: draw_bead_t, new_draw_bead, set_slip, is_on
  use effect, only: add_effect
  use model, only: model_t, increment_limit
  implicit none
  private

  public :: add_bead

contains

  !> Append one bead to the force stage, one effect for each patch whose face is not joined. Warned
  !! of are a bead that is not on the blank at the start, a line that leaves it, and a band too
  !! narrow for the elements.
  subroutine add_bead(scene, spec, model, errors)
    type(scene_t), intent(in) :: scene
    type(bead_spec_t), intent(in) :: spec
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(draw_bead_t) :: bead
    type(nurbs_surface_t) :: face
    type(nurbs_surface_t), allocatable :: faces(:)
    character(:), allocatable :: name
    integer :: p
    logical :: is_there
    real(wp), parameter :: part_of_width = 0.01_wp

    is_there = .false.
    allocate (faces(0))
    do p = 1, size(scene%blank%patches)
      if (scene%blank%patches(p)%is_joined(spec%face)) cycle
      associate (body => model%bodies%blank%parts(p)%element)
        if (.not. body%can_touch(spec%face)) then
          call add_error(errors, spec%origin, "the draw bead "//spec%name// &
                         " on an edge of a shell", "FACE=ZETA_MIN or FACE=ZETA_MAX")
          return
        end if
        face = body%surface(spec%face)
        call take_spec(spec, curve_of(scene, spec%curve), p, bead)
        faces = [faces, face]
        name = "draw bead "//spec%name
        if (size(scene%blank%patches) > 1) name = name//" "//scene%blank%patches(p)%name
        if (allocated(body%ties%share)) then
          call new_draw_bead(bead, face, name, body%ties%share)
        else
          call new_draw_bead(bead, face, name)
        end if
        is_there = is_there .or. is_on(bead, face)
        call set_slip(bead, merge(spec%slip, part_of_width*spec%width, spec%slip > 0.0_wp), &
                      sum(body%mass)/area_of(face), increment_limit(model))
      end associate
      call add_effect(model%forces, bead)
    end do
    if (spec%first_step > 1) return
    if (is_there) then
      call check_line(spec, faces, errors)
    else
      call add_warning(errors, spec%origin, "the draw bead "//spec%name//", which is nowhere "// &
                       "on the blank", "a line within half its WIDTH of the FACE")
    end if
  end subroutine add_bead

  !> A new bead with what the deck says of it.
  pure subroutine take_spec(spec, curve, patch, bead)
    type(bead_spec_t), intent(in) :: spec
    type(curve_t), intent(in) :: curve
    integer, intent(in) :: patch
    type(draw_bead_t), intent(out) :: bead

    bead%part = patch
    bead%face = spec%face
    bead%line = spec%line
    bead%half_width = 0.5_wp*spec%width
    bead%restraint = spec%restraint
    bead%hold_down = spec%hold_down
    bead%outward = real(face_side(spec%face), wp)
    bead%curve = curve
    bead%closing = spec%closing
    bead%given_step = spec%given_step
    bead%first_step = spec%first_step
    bead%last_step = spec%last_step
  end subroutine take_spec

  !> Walk along the line: how much of it is off the sheet, and how wide elements are across it.
  subroutine check_line(spec, faces, errors)
    type(bead_spec_t), intent(in) :: spec
    type(nurbs_surface_t), intent(in) :: faces(:)
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: least = 3            ! elements across the band
    integer, parameter :: n_parts = 16         ! of a length as long as the band is wide
    type(tool_t) :: sheet
    type(hit_t) :: hit
    type(error_t), allocatable :: error
    real(wp) :: part(3), x(3), length, off, widest, width, worst(3)
    integer :: s, i, n

    call new_tool(sheet, "sheet", faces, 1, spec%width, error)
    if (allocated(error)) then
      call add_warning(errors, spec%origin, "a line whose position on the blank cannot be "// &
                       "checked ("//error%message//")", &
                       "patches that a tool could be made of as well")
      return
    end if
    length = 0.0_wp
    off = 0.0_wp
    widest = 0.0_wp
    do s = 1, size(spec%line, 2) - 1
      part = spec%line(:, s + 1) - spec%line(:, s)
      n = max(n_parts, min(1000, ceiling(n_parts*norm2(part)/spec%width)))
      do i = 1, n
        x = spec%line(:, s) + (i - 0.5_wp)/n*part
        call search_all_faces(sheet, x, hit)
        length = length + norm2(part)/n
        if (hit%distance > spec%width) off = off + norm2(part)/n
        if (hit%distance > spec%width) cycle
        width = width_across(sheet, hit, x, part)
        if (width > widest) worst = x
        widest = max(widest, width)
      end do
    end do
    if (off > 0.0_wp) call add_warning(errors, spec%origin, "a line of which "// &
      rounded_text(off)//" of "//rounded_text(length)//" is off the sheet by more than WIDTH", &
      "a line on the blank, which its ends may leave by WIDTH")
    if (least*widest > spec%width*(1.0_wp + 1.0e-6_wp)) call add_warning(errors, spec%origin, &
      "a band of WIDTH="//rounded_text(spec%width)//" over elements that are "// &
      rounded_text(widest)//" wide across the line at "//place_text(worst), &
      "a WIDTH of at least three elements, or the force is not exact")
  end subroutine check_line

  !> Width of the element below a point across a line: the longer of its sides seen along it.
  pure real(wp) function width_across(sheet, hit, x, along) result(width)
    type(tool_t), intent(in) :: sheet
    type(hit_t), intent(in) :: hit
    real(wp), intent(in) :: x(3), along(3)
    type(separation_t) :: state
    real(wp) :: across(3)

    state = separation(sheet%coefficients, hit%face, hit%at, x)
    across = cross(unit_normal(state%d1), along)
    across = across/max(norm2(across), tiny(1.0_wp))
    width = max(abs(dot_product(state%d1(:, 1), across)), abs(dot_product(state%d1(:, 2), across)))
  end function width_across

  !> Area of a face at the start.
  real(wp) function area_of(face) result(area)
    type(nurbs_surface_t), intent(in) :: face
    type(secondary_surface_t) :: points
    type(error_t), allocatable :: error

    call new_secondary_surface(points, face, points_gauss, [0, 0], error)
    area = sum(points%area)
  end function area_of

end module bead_setup
