!> Loads of the scene as effects of the model.
module load_setup
  use kinds, only: wp
  use faults, only: fault_list_t, add_fault
  use scene, only: scene_t, load_spec_t
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: solid_face, face_axes, face_side
  use motion_curve, only: curve_t
  use blank, only: face_slice
  use face_quadrature, only: face_rule_t, new_face_rule
  use dead_load, only: gravity_load, traction_load
  use pressure, only: pressure_t
  use set_range, only: face_of_set
  use effect, only: effect_slot_t
  use model, only: model_t
  implicit none
  private

  public :: add_load

contains

  !> Append one load to the force stage. A set that is on no face or holds no element is a fault.
  subroutine add_load(scene, spec, curve, model, faults)
    type(scene_t), intent(in) :: scene
    type(load_spec_t), intent(in) :: spec
    type(curve_t), intent(in) :: curve
    type(model_t), intent(inout) :: model
    type(fault_list_t), intent(inout) :: faults
    type(effect_slot_t) :: slot
    type(nurbs_surface_t) :: surface
    type(face_rule_t) :: rule
    integer :: face, bounds(3, 2), axes(2)

    if (spec%kind == "GRAVITY") then
      allocate (slot%item, source=gravity_load(model%bodies%blank, spec%value, curve))
    else
      associate (solid => scene%blank%solid, set => scene%sets(spec%set))
        face = face_of_set(solid, set)
        if (face == 0) then
          call add_fault(faults, spec%origin, "set '"//set%name//"', which is not on a face", &
                         "a set on one of the faces of the blank")
          return
        end if
        surface = solid_face(solid, face)
        bounds = face_slice(model%bodies%blank%patch%n_control, face)
        axes = face_axes(face)
        rule = new_face_rule(surface, set%lower(axes), set%upper(axes), face_side(face))
        if (.not. any(rule%is_loaded)) then
          call add_fault(faults, spec%origin, "set '"//set%name//"', which holds no element", &
                         "a set that holds the middle of an element of its face")
          return
        end if
        if (spec%kind == "PRESSURE") then
          allocate (slot%item, source=new_pressure(rule, bounds, spec%value(1), curve))
        else
          allocate (slot%item, source=traction_load(surface, rule, bounds(:, 1), bounds(:, 2), &
                                                    spec%value, curve))
        end if
      end associate
    end if
    model%forces = [model%forces, slot]
  end subroutine add_load

  pure function new_pressure(rule, bounds, value, curve) result(load)
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: bounds(3, 2)
    real(wp), intent(in) :: value
    type(curve_t), intent(in) :: curve
    type(pressure_t) :: load

    load%name = "pressure"
    load%rule = rule
    load%lower = bounds(:, 1)
    load%upper = bounds(:, 2)
    load%value = value
    load%curve = curve
  end function new_pressure

end module load_setup
