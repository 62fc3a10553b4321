!> Build the model from the scene. What only shows here, such as a blank that starts inside a
!! tool, is reported like any other error of the deck.
module model_setup
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: origin_t, error_list_t, add_error, add_warning, drop_warnings, n_errors
  use text, only: to_text, rounded_text, counted
  use scene, only: face_of_set, scene_t, blank_spec_t, patch_spec_t, probe_spec_t, &
                   motion_spec_t, material_spec_t
  use linear_algebra, only: cross
  use knot_vector, only: n_spans
  use patch_seams, only: column_mask_t
  use block_law, only: block_law_t
  use user_library, only: user_library_t
  use law_setup, only: build_law, refuse_call
  use initial_setup, only: set_initial_fields, add_field_changes, set_initial_states, &
                         find_initial_moduli, lacks_gradients, n_fields_of
  use tool_setup, only: start_tools
  use drive_setup, only: add_drives
  use spurious_modes, only: n_spurious_modes, serving_rule
  use stability_setup, only: set_stable_step, add_thickness_scaling, add_damping, share_penalties
  use strain_projection, only: projection_spec_t, project_volume, project_sheet, default_samples
  use blank, only: blank_t, new_blank, columns_of
  use blank_trim, only: cut_blank, slit_words, slit_remedy
  use outline_units, only: unit_hint
  use body_parts, only: lead_edges
  use rigid_motion, only: move_tool, rigid_motion_t, motion_term_t
  use boundary, only: leave_cut_points
  use boundary_setup, only: members_t, find_members, add_supports, curve_of
  use element, only: element_t
  use element_kinds, only: reduce_to_plane
  use effect, only: sort_effects
  use model, only: hold_back_forces, model_t, increment_limit
  use load_setup, only: add_load
  use bead_setup, only: add_bead
  use watch_setup, only: list_watched, warn_of_gone, element_at
  use contact_setup, only: add_contact
  implicit none
  private

  public :: build_model, last_change

contains

  !> Model of a checked scene; unusable where an error was added.
  subroutine build_model(scene, model, errors, library)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(out) :: model
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library   !! for *USER MATERIAL
    integer :: i, before

    before = n_errors(errors)
    model%step = scene%step
    model%output = scene%output
    model%width_ratio = scene%width_ratio
    allocate (model%later_steps(0))
    if (allocated(scene%later_steps)) model%later_steps = scene%later_steps
    allocate (model%forces(0), model%later_forces(0), model%retired(0))
    model%step_starts = [0.0_wp]
    allocate (model%probes, source=scene%probes)
    call build_blank(scene, model, errors, library)
    if (n_errors(errors) == before) call set_outline(scene, model, errors)
    call start_tools(scene, model%bodies%tools, errors)
    call set_motions(scene, model)
    if (n_errors(errors) > before) return
    do i = 1, size(scene%tools)
      call move_tool(model%motions(i), 0.0_wp, 0.0_wp, model%bodies%tools(i))
    end do

    if (scene%step%thickness_factor > 1.0_wp) call check_columns(scene, model%bodies%blank, errors)
    if (n_errors(errors) > before) return
    call set_initial_velocities(scene, model)
    call lead_edges(model%bodies%blank%parts)
    call add_supports(scene, model, errors)
    call leave_cut_points(model%supports, model%bodies%blank%parts)
    call leave_cut_points(model%later_supports, model%bodies%blank%parts)
    call add_field_changes(scene, model)
    call set_stable_step(model)
    if (scene%reduction%component > 0) then
      associate (blank => model%bodies%blank)
        call reduce_to_plane(blank%parts(1), blank%law, scene%reduction%component)
      end associate
    end if
    call check_step(scene, model, errors)
    if (n_errors(errors) > before) return
    do i = 1, size(scene%contacts)
      if (scene%contacts(i)%last_step < scene%contacts(i)%first_step) cycle
      before = n_errors(errors)
      call add_contact(scene, scene%contacts(i), model, errors)
      if (n_errors(errors) > before) &
        call drop_warnings(errors, scene%tools(scene%contacts(i)%tool)%origin)
    end do
    if (size(scene%contacts) > 0) call share_penalties(scene%contacts(1)%origin, model, errors)
    do i = 1, size(scene%loads)
      call add_load(scene, scene%loads(i), model, errors)
    end do
    do i = 1, size(scene%beads)
      if (scene%beads(i)%last_step < scene%beads(i)%first_step) cycle
      call add_bead(scene, scene%beads(i), model, errors)
    end do
    call add_drives(scene, model, errors)
    call add_thickness_scaling(model)
    call add_damping([(last_change(scene, i, .false.), i=1, 1 + size(model%later_steps))], &
                     [(last_change(scene, i, .true.), i=1, 1 + size(model%later_steps))], model)
    call sort_effects(model%forces)
    call sort_effects(model%supports)
    call hold_back_forces(model)
  end subroutine build_model

  !> Warn of columns through the thickness that seams keep from being scaled.
  subroutine check_columns(scene, blank, errors)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(in) :: blank
    type(error_list_t), intent(inout) :: errors
    type(column_mask_t), allocatable :: is_whole(:)
    integer :: p, n

    is_whole = columns_of(blank)
    n = sum([(count(.not. is_whole(p)%values), p=1, size(is_whole))])
    if (n > 0) call add_warning(errors, scene%step%origin, "mass scaling through the thickness "// &
                                "that leaves out "//counted(n, "column")//" of control points, "// &
                                "which are not one along each seam they touch", &
                                "seams that run through the thickness, axis 3 of both patches")
  end subroutine check_columns

  !> Refuse a stable step that is no number, and warn of more steps than a machine takes in days.
  subroutine check_step(scene, model, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: many = 1.0e9_wp
    real(wp), parameter :: soft = 2.5_wp    ! elements
    real(wp) :: n_steps

    if (.not. (ieee_is_finite(model%stable_step) .and. ieee_is_finite(model%rate) &
               .and. model%stable_step > 0.0_wp)) then
      call add_error(errors, scene%materials(scene%blank%material)%origin, &
                     "stiffness and density that give no usable stable time increment ("// &
                     to_text(model%stable_step)//")", "values in consistent units")
      return
    end if
    associate (softness => model%bodies%blank%joints%softness)
      if (softness > soft) call add_warning(errors, scene%blank%origin, "joints of shells that "// &
        "turn as much as "//rounded_text(softness)//" elements bend, for a stiffer one would "// &
        "shorten the time increment", "elements along the joints that are at least as long as "// &
        "the sheet is thick")
    end associate
    if (model%step%safety > 1.0_wp) call add_warning(errors, scene%step%origin, &
      "SCALE FACTOR="//to_text(model%step%safety)//", above the stable time increment", &
      "at most 1")
    n_steps = model%step%duration/increment_limit(model)
    if (n_steps > many) call add_warning(errors, scene%step%origin, "a time period of about "// &
      rounded_text(n_steps)//" increments of "//rounded_text(increment_limit(model)), &
      "fewer: check the units of the deck, shorten the process or scale masses")
  end subroutine check_step

  !> Time of a step, or of the run, from which the curves that begin in the step and count that time
  !! are constant.
  pure real(wp) function last_change(scene, step, is_total) result(time)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical, intent(in) :: is_total   !! curves against the time of the run, else of the step
    integer :: i

    time = 0.0_wp
    do i = 1, size(scene%curves)
      if (scene%curves(i)%is_total .neqv. is_total) cycle
      if (any([pack(scene%boundaries%curve, scene%boundaries%first_step == step), &
               pack(scene%loads%curve, scene%loads%first_step == step), &
               pack(scene%motions%curve, scene%motions%step == step)] == i)) &
        time = max(time, maxval(scene%curves(i)%times))
    end do
  end function last_change

  !> Law, patch and mass.
  subroutine build_blank(scene, model, errors, library)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library
    real(wp), parameter :: short = 1.0e-6_wp   ! of the duration: about an increment
    class(block_law_t), allocatable :: law
    type(material_spec_t) :: material
    type(error_t), allocatable :: error
    real(wp) :: period
    integer :: p, i, n

    material = scene%materials(scene%blank%material)
    material%is_sheet = scene%blank%is_shell
    associate (spec => scene%blank)
      do p = 1, size(spec%patches)
        call check_rule(spec, spec%patches(p), scene%reduction%axis, errors)
      end do
      call build_law(material, law, errors, library, n_fields_of(scene))
      if (.not. allocated(law)) return
      if (law%uses_gradient .and. spec%projection == "ANS") &
        call add_error(errors, spec%origin, "PROJECTION=ANS with a material whose stress "// &
                       "follows from the deformation gradient", "BBAR or NONE")
      call new_blank(model%bodies%blank, spec%name, spec%patches, law, &
                     [scene%step%viscosity_linear, scene%step%viscosity_quadratic], error, &
                     spec%merge_distance, projection_of(spec), spec%is_shell, spec%has_hinges)
      if (allocated(error)) then
        call add_error(errors, spec%origin, error%message, "a right-handed patch "// &
                       "with positive volume everywhere")
      else
        if (scene%step%viscosity_bending > 0.0_wp) then
          do p = 1, size(model%bodies%blank%parts)
            call model%bodies%blank%parts(p)%element%damp_bending(scene%step%viscosity_bending)
          end do
        end if
        if (spec%has_hinges .and. model%bodies%blank%joints%n_lines == 0) &
          call add_warning(errors, spec%origin, "JOINTS=HINGED of a blank without joints: no "// &
                           "edges meet, and no knot comes as often as the degree", "no JOINTS")
        n = model%bodies%blank%law%n_state - model%bodies%blank%law%n_hidden - material%n_uvarm
        do i = 1, size(scene%initial_states)
          associate (start => scene%initial_states(i))
            if (size(start%values) > n) call add_error(errors, start%origin, &
              counted(size(start%values), "state variable")//" for "//start%name, &
              to_text(n)//" at most, as the material has")
          end associate
        end do
        call set_initial_states(scene, model%bodies%blank)
        call set_initial_fields(scene, model%bodies%blank)
        period = max(scene%step%duration, scene%step%static_increment)
        call find_initial_moduli(short*period, model%bodies%blank, error)
        if (allocated(error)) call refuse_call(material, error, errors)
        if (.not. present(library)) return
        if (.not. library%is_loaded .or. allocated(error)) return
        if (lacks_gradients(short*period, model%bodies%blank)) &
          call add_warning(errors, material%origin, "KINEMATICS=SMALL with a UMAT that uses "// &
                           "DFGRD0 or DFGRD1, which are then NaN", "FULL, or a UMAT that works "// &
                           "from DSTRAN and DROT alone")
      end if
    end associate
  end subroutine build_blank

  !> Cut the blank to its outline, and keep what later steps will cut.
  subroutine set_outline(scene, model, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    character(:), allocatable :: hint
    integer :: i

    allocate (model%trims(0), model%watched(0))
    if (.not. allocated(scene%outlines)) return
    if (size(scene%outlines) == 0) return
    deallocate (model%trims)
    allocate (model%trims(size(scene%outlines)))
    associate (blank => model%bodies%blank)
      if (blank%joints%n_lines > 0 .or. blank%seams%n_groups > 0) then
        call add_error(errors, scene%outlines(1)%origin, "an outline of a sheet with joints, "// &
                       "which is closed upon itself or has knots as often as its degree", &
                       "a sheet without joints")
        return
      end if
      if (.not. blank%parts(1)%element%can_be_cut) then
        call add_error(errors, scene%outlines(1)%origin, "an outline of solids with "// &
                       "PROJECTION", "ELEMENT=SHELL, or no PROJECTION")
        return
      end if
    end associate
    do i = 1, size(model%trims)
      associate (spec => scene%outlines(i), trim => model%trims(i))
        trim%name = spec%name
        trim%step = spec%step
        trim%axis = spec%axis
        trim%is_outside = spec%is_outside
        trim%n_pieces = spec%n_pieces
        trim%is_flat = spec%is_flat
        trim%polygons = spec%polygons
        trim%origin = spec%origin
        trim%origins = spec%origins
        if (spec%step > 1) then   ! at time 0 the sheet lies as it is
          call refuse_fixed_loads(scene, spec%step, spec%origin, errors)
          cycle
        end if
        call cut_blank(trim, model%bodies%blank, error, trim%loss)
        if (.not. allocated(error)) then
          if (.not. trim%loss%share > 0.0_wp) call add_warning(errors, spec%origin, &
            "curves that cut nothing away", "other curves, KEEP or DIRECTION")
          if (trim%loss%slit%is_there) call add_warning(errors, spec%origin, &
            slit_words(trim%loss%slit), slit_remedy(trim%loss%slit))
          cycle
        end if
        hint = unit_hint(trim, model%bodies%blank%parts(1)%element, scene%units)
        if (hint /= "") hint = "; "//hint
        call add_error(errors, spec%origin, error%message, "curves that meet the sheet and "// &
                       "keep as many pieces of it as PIECES says"//hint)
        return
      end associate
    end do
    call check_probes(model%bodies%blank%parts(1)%element, model%probes, errors)
    call list_watched(scene, model%bodies%blank, model%watched)
    call warn_of_gone(model%bodies%blank, model%watched, errors)
  end subroutine set_outline

  !> Refuse history points in elements that are not there.
  subroutine check_probes(element, probes, errors)
    class(element_t), intent(in) :: element
    type(probe_spec_t), intent(in) :: probes(:)
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(probes)
      if (element%is_outside(element_at(element, probes(i)%xi))) &
        call add_error(errors, probes(i)%origin, "the history point "//probes(i)%name// &
                       " outside of the outline", "a point of the sheet that is there")
    end do
  end subroutine check_probes

  !> Tractions and draw beads have taken the sheet as it was before it is trimmed.
  subroutine refuse_fixed_loads(scene, step, origin, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(origin_t), intent(in) :: origin
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: first_large = 5   ! faces from here on are the large ones
    integer :: i

    do i = 1, size(scene%loads)
      if (scene%loads(i)%kind == "GRAVITY" .or. scene%loads(i)%last_step < step) cycle
      associate (set => scene%sets(scene%loads(i)%set))
        if (scene%loads(i)%kind == "TRACTION" .or. &
            face_of_set(scene%blank%patches(1)%solid, set, 1) < first_large) &
          call add_error(errors, origin, "a trim of a sheet with a load on '"//set%name//"'", &
                         "*PRESSURE on ZETA_MIN or ZETA_MAX, or the end of the load before, by "// &
                         "OP=NEW in this step")
      end associate
    end do
    do i = 1, size(scene%beads)
      if (scene%beads(i)%last_step >= step) call add_error(errors, origin, "a trim of a sheet "// &
        "with the draw bead "//scene%beads(i)%name, "*MODEL CHANGE, REMOVE in this step")
    end do
  end subroutine refuse_fixed_loads

  !> A rule that leaves deformations without energy is refused, and one that serves is named.
  subroutine check_rule(spec, patch, across, errors)
    type(blank_spec_t), intent(in) :: spec
    type(patch_spec_t), intent(in) :: patch
    integer, intent(in) :: across               !! axis of plane strain, 0: none
    type(error_list_t), intent(inout) :: errors
    type(projection_spec_t) :: projection
    integer :: n_modes, axis, n_elements(3), rule(3)

    n_elements = [(n_spans(patch%solid%axes(axis)), axis=1, 3)]
    projection = projection_of(spec)
    if (spec%is_shell) return
    associate (degrees => patch%solid%axes%degree)
      if (any(projection%n_samples > patch%n_points*patch%n_parts)) return
      n_modes = n_spurious_modes(degrees, n_elements, patch%n_points, patch%n_parts, projection, &
                                 across)
      if (n_modes == 0) return
      rule = serving_rule(degrees, n_elements, patch%n_points, patch%n_parts, projection, across)
      if (any(projection%n_samples > 0)) then
        rule = default_samples(degrees, patch%n_points*patch%n_parts)
        call add_error(errors, spec%origin, 'samples that leave '//to_text(n_modes)// &
                       " or more deformations of this patch without energy", &
                       'more samples, such as PROJECTION TERMS='//quoted(rule))
        return
      end if
    end associate
    call add_error(errors, spec%origin, "a quadrature rule that leaves "//to_text(n_modes)// &
                   " or more deformations of this patch without energy", "more points, such as "// &
                   'QUADRATURE='//quoted(rule))
  end subroutine check_rule

  !> The projection that the deck asks for, in the terms of the element.
  pure function projection_of(spec) result(projection)
    type(blank_spec_t), intent(in) :: spec
    type(projection_spec_t) :: projection

    select case (spec%projection)
    case ("BBAR")
      projection%kind = project_volume
    case ("ANS")
      projection%kind = project_sheet
    end select
    projection%n_samples = spec%n_samples
    projection%is_smooth = spec%is_smooth
  end function projection_of

  !> Three counts as the deck takes them.
  pure function quoted(counts) result(list)
    integer, intent(in) :: counts(3)
    character(:), allocatable :: list

    list = '"'//to_text(counts(1))//","//to_text(counts(2))//","//to_text(counts(3))//'"'
  end function quoted

  !> Motions of all tools; those of one step add up.
  subroutine set_motions(scene, model)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(rigid_motion_t) :: motion
    integer :: i, j

    allocate (model%motions(size(scene%tools)), model%later_motions(0))
    do i = 1, size(scene%tools)
      model%motions(i) = no_motion(i, 1)
    end do
    do i = 1, size(scene%motions)
      associate (spec => scene%motions(i))
        if (spec%step == 1) then
          call add_term(scene, spec, model%motions(spec%tool))
          cycle
        end if
        do j = 1, size(model%later_motions)
          if (model%later_motions(j)%tool == spec%tool .and. &
              model%later_motions(j)%step == spec%step) exit
        end do
        if (j > size(model%later_motions)) then
          motion = no_motion(spec%tool, spec%step)
          model%later_motions = [model%later_motions, motion]
        end if
        call add_term(scene, spec, model%later_motions(j))
      end associate
    end do
  end subroutine set_motions

  pure function no_motion(tool, step) result(motion)
    integer, intent(in) :: tool, step
    type(rigid_motion_t) :: motion

    allocate (motion%terms(0))
    motion%tool = tool
    motion%step = step
  end function no_motion

  subroutine add_term(scene, spec, motion)
    type(scene_t), intent(in) :: scene
    type(motion_spec_t), intent(in) :: spec
    type(rigid_motion_t), intent(inout) :: motion
    type(motion_term_t) :: term

    motion%is_driven = motion%is_driven .or. spec%is_force
    if (spec%is_force) return
    term%is_displacement = spec%is_displacement
    term%is_rotation = spec%is_rotation
    term%point = spec%point
    term%vector = spec%vector
    term%curve = curve_of(scene, spec%curve)
    motion%terms = [motion%terms, term]
  end subroutine add_term

  !> Initial velocities; those of several entries add up.
  subroutine set_initial_velocities(scene, model)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(members_t), allocatable :: members(:)
    integer :: n, p, i, j, k

    do n = 1, size(scene%initial_velocities)
      associate (spec => scene%initial_velocities(n), blank => model%bodies%blank)
        if (spec%set > 0) call find_members(blank, scene%sets(spec%set), members)
        do p = 1, size(blank%parts)
          associate (motion => blank%parts(p)%element%motion)
            do k = 1, size(motion%x, 3)
              do j = 1, size(motion%x, 2)
                do i = 1, size(motion%x, 1)
                  if (spec%set > 0) then
                    if (.not. members(p)%is_in(i, j, k)) cycle
                  end if
                  motion%v(i, j, k, :) = motion%v(i, j, k, :) + spec%velocity &
                    + cross(spec%omega, motion%x(i, j, k, :) - spec%centre)
                end do
              end do
            end do
          end associate
        end do
      end associate
    end do
  end subroutine set_initial_velocities

end module model_setup
