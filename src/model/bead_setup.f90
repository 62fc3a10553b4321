!> Draw beads of the scene as effects of the model.
module bead_setup
  use kinds, only: wp
  use scene, only: bead_spec_t, blank_spec_t
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: solid_face, face_side
  use slave_surface, only: slave_surface_t, new_slave_surface, points_gauss
  use errors, only: error_t
  use blank, only: face_slice
  use motion_curve, only: curve_t
  use draw_bead, only: draw_bead_t, new_draw_bead, set_slip, is_on
  use faults, only: fault_list_t, add_warning
  use effect, only: effect_slot_t
  use model, only: model_t
  implicit none
  private

  public :: add_bead

contains

  !> Append one bead to the force stage, one effect for each patch whose face is not joined. A
  !! bead that is not on the blank at the start is warned of.
  subroutine add_bead(spec, blank_spec, curve, model, faults)
    type(bead_spec_t), intent(in) :: spec
    type(blank_spec_t), intent(in) :: blank_spec
    type(curve_t), intent(in) :: curve
    type(model_t), intent(inout) :: model
    type(fault_list_t), intent(inout) :: faults
    type(draw_bead_t) :: bead
    type(nurbs_surface_t) :: face
    type(effect_slot_t) :: slot
    integer :: p
    logical :: is_there
    real(wp), parameter :: part_of_width = 0.01_wp

    is_there = .false.
    do p = 1, size(blank_spec%patches)
      if (blank_spec%patches(p)%is_joined(spec%face)) cycle
      associate (body => model%bodies%blank%parts(p))
        face = solid_face(body%solid, spec%face)
        call take_spec(spec, curve, p, face_slice(body%patch%n_control, spec%face), bead)
        call new_draw_bead(bead, face, bead_name(spec, blank_spec, p))
        is_there = is_there .or. is_on(bead, face)
        call set_slip(bead, merge(spec%slip, part_of_width*spec%width, spec%slip > 0.0_wp), &
                      sum(body%mass)/area_of(face), model%step%safety*model%stable_step)
      end associate
      allocate (slot%item, source=bead)
      model%forces = [model%forces, slot]
      deallocate (slot%item)
    end do
    if (spec%first_step > 1 .or. is_there) return
    call add_warning(faults, spec%origin, "the draw bead "//spec%name//", which is nowhere on "// &
                     "the blank", "a line within half its WIDTH of the FACE")
  end subroutine add_bead

  !> A new bead with what the deck says of it.
  pure subroutine take_spec(spec, curve, patch, bounds, bead)
    type(bead_spec_t), intent(in) :: spec
    type(curve_t), intent(in) :: curve
    integer, intent(in) :: patch, bounds(3, 2)     !! control points of its face, from `face_slice`
    type(draw_bead_t), intent(out) :: bead

    bead%part = patch
    bead%lower = bounds(:, 1)
    bead%upper = bounds(:, 2)
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

  pure function bead_name(spec, blank_spec, p) result(name)
    type(bead_spec_t), intent(in) :: spec
    type(blank_spec_t), intent(in) :: blank_spec
    integer, intent(in) :: p
    character(:), allocatable :: name

    name = "draw bead "//spec%name
    if (size(blank_spec%patches) > 1) name = name//" "//blank_spec%patches(p)%name
  end function bead_name

  !> Area of a face at the start.
  real(wp) function area_of(face) result(area)
    type(nurbs_surface_t), intent(in) :: face
    type(slave_surface_t) :: points
    type(error_t), allocatable :: error

    call new_slave_surface(points, face, points_gauss, [0, 0], error)
    area = sum(points%area)
  end function area_of

end module bead_setup
