!> Loads of the scene as effects of the model.
module load_setup
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use scene, only: scene_t, load_spec_t, set_spec_t, face_of_set
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: face_axes, face_side
  use motion_curve, only: curve_t
  use element, only: element_t
  use blank, only: face_slice
  use face_quadrature, only: face_rule_t, new_face_rule
  use loads, only: gravity_load, traction_load, new_pressure
  use boundary_setup, only: curve_of
  use effect, only: effect_t, add_effect
  use model, only: model_t
  implicit none
  private

  public :: add_load

contains

  !> Append one load to the force stage, one effect for each patch that it acts on. A set that is
  !! on no face or holds no element is an error; faces joined to others carry no load.
  subroutine add_load(scene, spec, model, errors)
    type(scene_t), intent(in) :: scene
    type(load_spec_t), intent(in) :: spec
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    class(effect_t), allocatable :: load
    type(curve_t) :: curve
    integer, parameter :: first_large = 5   ! faces from here on are the large ones
    logical :: has_face, has_element
    integer :: p, face

    curve = curve_of(scene, spec%curve)
    has_face = .false.
    has_element = .false.
    do p = 1, size(scene%blank%patches)
      if (spec%kind == "GRAVITY") then
        allocate (load, source=gravity_load(model%bodies%blank, p, spec%value, curve))
      else
        associate (patch => scene%blank%patches(p), set => scene%sets(spec%set))
          face = face_of_set(patch%solid, set, p)
          if (face == 0) cycle
          has_face = .true.
          if (patch%is_joined(face)) cycle
          associate (body => model%bodies%blank%parts(p)%element)
            if (face < first_large .and. allocated(body%ties%share)) then
              call add_error(errors, spec%origin, "a load on the edge '"//set%name//"' of a "// &
                             "sheet with an outline", "a load on ZETA_MIN or ZETA_MAX")
              return
            end if
            call new_face_load(spec, body, set, p, face, scene%reduction%axis, curve, load)
          end associate
        end associate
        if (.not. allocated(load)) cycle
      end if
      has_element = .true.
      load%first_step = spec%first_step
      load%given_step = spec%first_step
      load%last_step = spec%last_step
      if (size(scene%blank%patches) > 1) load%name = load%name//" "//scene%blank%patches(p)%name
      call add_effect(model%forces, load)
      deallocate (load)
    end do
    if (has_element) return
    associate (name => scene%sets(spec%set)%name)
      if (has_face) then
        call add_error(errors, spec%origin, "set '"//name//"', which contains no element"// &
                       trim(merge(" that the outline leaves", "                        ", &
                                  allocated(model%bodies%blank%parts(1)%element%ties%share))), &
                       "a set that contains the middle of an element of its face")
      else
        call add_error(errors, spec%origin, "set '"//name//"', which is not on a face", &
                       "a set on one of the faces of the blank")
      end if
    end associate
  end subroutine add_load

  !> Pressure or traction on the part of a face that lies in a set; nothing if that is no element.
  subroutine new_face_load(spec, body, set, part, face, across, curve, load)
    type(load_spec_t), intent(in) :: spec
    class(element_t), intent(in) :: body
    type(set_spec_t), intent(in) :: set
    integer, intent(in) :: part, face
    integer, intent(in) :: across            !! axis of plane strain, 0: none
    type(curve_t), intent(in) :: curve
    class(effect_t), allocatable, intent(out) :: load
    type(nurbs_surface_t) :: surface
    type(face_rule_t) :: rule
    integer :: axes(2), bounds(3, 2)

    surface = body%surface(face)
    axes = face_axes(face)
    rule = new_face_rule(surface, set%lower(axes, part), set%upper(axes, part), face_side(face), &
                         findloc(axes, across, 1))
    if (allocated(body%ties%share)) then
      rule%share = body%ties%share
      rule%is_loaded = rule%is_loaded .and. rule%share > 0.0_wp
    end if
    if (.not. any(rule%is_loaded)) return
    if (spec%kind == "PRESSURE") then
      allocate (load, source=new_pressure(part, face, rule, spec%value(1), curve))
    else
      bounds = face_slice(body%grid%axes%n_basis, face)
      if (body%is_own_face(face)) bounds = reshape([1, 1, 1, shape(surface%weights), 1], [3, 2])
      allocate (load, source=traction_load(part, face, surface, rule, bounds, spec%value, curve))
    end if
  end subroutine new_face_load

end module load_setup
