!> Bends of tools that are too sharp for shells, which have no shear through the thickness.
module bend_check
  use kinds, only: wp
  use text, only: rounded_text, place_text
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t
  use model, only: model_t
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  use tool_bends, only: bend_t, tool_bends_below
  use sheet_target, only: sheet_target_t, new_sheet_target
  use sweep, only: frame_t, position_at, in_space
  use reach_check, only: encounter_t
  implicit none
  private

  public :: check_bends

  real(wp), parameter :: least_ratio = 5.0_wp   !! of the radius of a tool over the thickness
  real(wp), parameter :: facing = 0.3_wp        !! cosine between surfaces that face each other

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
    type(hit_t) :: hit
    real(wp) :: x(3)
    integer :: i

    sharpest%radius = limit*(1.0_wp - 1.0e-6_wp)   ! round-off of a radius that is just allowed
    frame = position_at(encounter%path, 0.0_wp)
    call tool_bends_below(model%bodies%tools(encounter%tool), sharpest%radius, bends)
    do i = 1, size(bends)
      if (bends(i)%radius >= sharpest%radius) cycle
      x = in_space(frame, bends(i)%x)
      call search_all_faces(target%surface, x, hit)
      if (is_beside(target%surface, hit, 0.0_wp)) cycle
      if (dot_product(matmul(frame%rotation, bends(i)%normal), hit%normal) > -facing) cycle
      sharpest = bends(i)
      sharpest%x = x
    end do
    if (.not. norm2(sharpest%normal) > 0.0_wp) sharpest%radius = limit
  end function sharpest_bend

end module bend_check
