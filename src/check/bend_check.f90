!> Bends of tools that are too sharp for shells, which have no shear through the thickness, or whose
!! springback takes more integration points through the thickness than the blank has.
module bend_check
  use kinds, only: wp
  use text, only: rounded_text, place_text, to_text
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t
  use model, only: model_t
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  use tool_bends, only: bend_t, tool_bends_below
  use knot_vector, only: n_spans
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use flow_stress, only: flow_stress_of
  use sheet_target, only: sheet_target_t, new_sheet_target
  use sweep, only: frame_t, position_at, in_space
  use reach_check, only: encounter_t
  implicit none
  private

  public :: check_bends, check_layers

  real(wp), parameter :: least_ratio = 5.0_wp   !! of the radius of a tool over the thickness
  real(wp), parameter :: facing = 0.3_wp        !! cosine between surfaces that face each other
  real(wp), parameter :: tolerance = 0.04_wp    !! of springback, for the points it is summed over
  real(wp), parameter :: flattest = 0.4_wp      !! half the elastic core over the thickness that
                                                !! counts: flatter bends hardly stay

contains

  !> Warn of each tool that bends a blank of shells too sharply.
  subroutine check_bends(scene, model, encounters, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    type(sheet_target_t) :: target
    type(bend_t) :: sharpest
    integer :: i

    if (.not. scene%blank%is_shell) return
    do i = 1, size(encounters)
      if (target%face /= encounters(i)%face) &
        call new_sheet_target(model%bodies%blank, encounters(i)%face, thickness, target)
      if (target%face == 0) cycle
      sharpest = sharpest_bend(model, encounters(i), target, least_ratio*thickness)
      if (sharpest%radius >= least_ratio*thickness) cycle
      call add_warning(errors, encounters(i)%origin, "tool '"// &
        model%bodies%tools(encounters(i)%tool)%name//"' with the radius "// &
        rounded_text(sharpest%radius)//" at "//place_text(sharpest%x)//", "// &
        rounded_text(sharpest%radius/thickness)//" times the thickness, and ELEMENT=SHELL", &
        "ELEMENT=SOLID, for shells have no shear through the thickness; or a radius of "// &
        rounded_text(least_ratio)//" times the thickness")
    end do
  end subroutine check_bends

  !> The sharpest bend of a tool against the blank where it lies at the start, its place in space;
  !! with the limit as its radius where none is below it.
  function sharpest_bend(model, encounter, target, limit) result(sharpest)
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    type(sheet_target_t), intent(in) :: target
    real(wp), intent(in) :: limit             !! [length]
    type(bend_t) :: sharpest
    type(bend_t), allocatable :: bends(:)
    type(frame_t) :: frame
    integer :: i

    sharpest%radius = limit*(1.0_wp - 1.0e-6_wp)   ! round-off of a radius that is just allowed
    frame = position_at(encounter%path, 0.0_wp)
    call tool_bends_below(model%bodies%tools(encounter%tool), sharpest%radius, bends)
    do i = 1, size(bends)
      if (bends(i)%radius >= sharpest%radius) cycle
      if (.not. is_at_sheet(target, frame, bends(i))) cycle
      sharpest = bends(i)
      sharpest%x = in_space(frame, bends(i)%x)
    end do
    if (.not. norm2(sharpest%normal) > 0.0_wp) sharpest%radius = limit
  end function sharpest_bend

  !> Does a bend of a tool face the blank where it lies at the start?
  logical function is_at_sheet(target, frame, bend)
    type(sheet_target_t), intent(in) :: target
    type(frame_t), intent(in) :: frame        !! of the tool
    type(bend_t), intent(in) :: bend
    type(hit_t) :: hit

    call search_all_faces(target%surface, in_space(frame, bend%x), hit)
    is_at_sheet = .false.
    if (is_beside(target%surface, hit, 0.0_wp)) return
    is_at_sheet = dot_product(matmul(frame%rotation, bend%normal), hit%normal) <= -facing
  end function is_at_sheet

  !> Warn of tools that a plastic blank springs back from whose radii take more points through the
  !! thickness than it has.
  subroutine check_layers(scene, model, encounters, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    type(sheet_target_t) :: target
    type(bend_t) :: worst
    real(wp) :: core_by_radius, missing
    integer :: n_points, n_parts, i

    core_by_radius = core_of(scene, model)/thickness
    if (.not. core_by_radius > 0.0_wp) return
    call points_through(scene, n_points, n_parts)
    do i = 1, size(encounters)
      if (.not. springs_back(scene, encounters(i))) cycle
      if (target%face /= encounters(i)%face) &
        call new_sheet_target(model%bodies%blank, encounters(i)%face, thickness, target)
      if (target%face == 0) cycle
      call find_worst_bend(model, encounters(i), target, core_by_radius, &
                           new_gauss_rule(n_points, n_parts), worst, missing)
      if (.not. missing > tolerance) cycle
      call add_warning(errors, encounters(i)%origin, "tool '"// &
        model%bodies%tools(encounters(i)%tool)%name//"' with the radius "// &
        rounded_text(worst%radius)//" at "//place_text(worst%x)//" and "// &
        to_text(n_parts)//"x"//to_text(n_points)//" points through the thickness: springback "// &
        "from there is wrong by up to "//to_text(nint(100.0_wp*missing))//" %", &
        enough_points(core_by_radius*worst%radius)//" through the thickness of one element, "// &
        "the third count of QUADRATURE")
    end do
  end subroutine check_layers

  !> Half the elastic core of a bent sheet over the radius of its middle, in plane strain without
  !! hardening: 2/sqrt(3) of the yield stress over E/(1 - nu^2); 0 where the law does not tell.
  real(wp) function core_of(scene, model) result(core)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    real(wp) :: modulus

    associate (k => model%bodies%blank%law%bulk, g => model%bodies%blank%law%shear)
      modulus = 4.0_wp*g*(3.0_wp*k + g)/(3.0_wp*k + 4.0_wp*g)
    end associate
    core = 2.0_wp/sqrt(3.0_wp)*flow_stress_of(scene%materials(scene%blank%material), 0.0_wp)/modulus
  end function core_of

  !> The fewest points through the thickness of the patches: of a part, and equal parts.
  pure subroutine points_through(scene, n_points, n_parts)
    type(scene_t), intent(in) :: scene
    integer, intent(out) :: n_points, n_parts
    integer :: p, parts

    n_points = 0
    n_parts = 0
    do p = 1, size(scene%blank%patches)
      associate (patch => scene%blank%patches(p))
        parts = patch%n_parts(3)
        if (.not. scene%blank%is_shell) parts = parts*n_spans(patch%solid%axes(3))
        if (p > 1 .and. patch%n_points(3)*parts >= n_points*n_parts) cycle
        n_points = patch%n_points(3)
        n_parts = parts
      end associate
    end do
  end subroutine points_through

  !> Is a tool gone in a later step that finds the equilibrium of the blank?
  pure logical function springs_back(scene, encounter)
    type(scene_t), intent(in) :: scene
    type(encounter_t), intent(in) :: encounter
    integer :: k

    springs_back = .false.
    if (.not. allocated(scene%later_steps)) return
    do k = 1, size(scene%later_steps)
      associate (step => scene%later_steps(k)%step)
        springs_back = springs_back .or. (encounter%last_step < k + 1 .and. &
                                          (step%is_static .or. step%has_relaxation))
      end associate
    end do
  end function springs_back

  !> The bend of a tool at the blank for whose springback a rule is worst.
  subroutine find_worst_bend(model, encounter, target, core_by_radius, rule, worst, missing)
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    type(sheet_target_t), intent(in) :: target
    real(wp), intent(in) :: core_by_radius    !! of a sheet as thick as 1 [1/length]
    type(gauss_rule_t), intent(in) :: rule    !! through the thickness
    type(bend_t), intent(out) :: worst        !! its place in space
    real(wp), intent(out) :: missing          !! error of the springback; 0: no bend counts
    type(bend_t), allocatable :: bends(:)
    type(frame_t) :: frame
    real(wp) :: error
    integer :: i

    missing = 0.0_wp
    frame = position_at(encounter%path, 0.0_wp)
    call tool_bends_below(model%bodies%tools(encounter%tool), flattest/core_by_radius, bends)
    do i = 1, size(bends)
      error = moment_error(rule, core_by_radius*bends(i)%radius)
      if (error <= max(missing, tolerance)) cycle
      if (.not. is_at_sheet(target, frame, bends(i))) cycle
      missing = error
      worst = bends(i)
      worst%x = in_space(frame, bends(i)%x)
    end do
  end subroutine find_worst_bend

  !> Largest error of the moment of a bent sheet as a rule sums it up, over radii around one:
  !! stress rises linearly to the surface of the elastic core and is constant beyond.
  pure real(wp) function moment_error(rule, core) result(error)
    type(gauss_rule_t), intent(in) :: rule    !! on -1 to 1
    real(wp), intent(in) :: core              !! half of it over the thickness, up to 0.5
    real(wp), parameter :: around = 1.4_wp    ! the error swings as points pass the core
    integer, parameter :: n_tried = 15
    real(wp) :: now
    integer :: i

    error = 0.0_wp
    do i = 0, n_tried
      now = min(max(core, 1.0e-3_wp)*around**(2.0_wp*i/n_tried - 1.0_wp), 0.5_wp)
      associate (y => 0.5_wp*abs(rule%points))
        error = max(error, abs(0.5_wp*sum(rule%weights*y*min(y/now, 1.0_wp)) &
                               /(0.25_wp - now**2/3.0_wp) - 1.0_wp))
      end associate
    end do
  end function moment_error

  !> The cheapest rule that is good enough for a bend.
  pure function enough_points(core) result(words)
    real(wp), intent(in) :: core              !! half of it over the thickness
    character(:), allocatable :: words
    integer, parameter :: parts(4) = [2, 2, 2, 4], points(4) = [2, 3, 4, 5]
    integer :: i

    do i = 1, size(parts) - 1
      if (moment_error(new_gauss_rule(points(i), parts(i)), core) <= tolerance) exit
    end do
    words = to_text(parts(i))//"x"//to_text(points(i))
  end function enough_points

end module bend_check
