!> What files a deck reads, where the surfaces of tools come from and where tools were put, for the
!! log and for --check.
module source_report
  use kinds, only: wp
  use scene, only: scene_t
  use model, only: model_t
  use text, only: string_t, rounded_text, place_text, append_text
  use system_files, only: true_path
  implicit none
  private

  public :: source_lines

contains

  !> One line for each file beside the deck with its path resolved, for each note on a tool, the
  !! tool's name before the first, and for each tool that *TOOL PLACEMENT has moved.
  function source_lines(scene, model) result(lines)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(string_t), allocatable :: lines(:)
    integer :: t, i

    allocate (lines(0))
    do i = 2, size(scene%files)
      call append_text(lines, "reads      "//true_path(scene%files(i)%value))
    end do
    do t = 1, size(scene%tools)
      if (.not. allocated(scene%tools(t)%notes)) cycle
      do i = 1, size(scene%tools(t)%notes)
        if (i == 1) then
          call append_text(lines, "tool "//scene%tools(t)%name//" from "// &
                                  scene%tools(t)%notes(1)%value)
        else
          call append_text(lines, "  "//scene%tools(t)%notes(i)%value)
        end if
      end do
    end do
    do t = 1, size(scene%tools)
      if (.not. any(abs(scene%tools(t)%placing) > 0.0_wp)) cycle
      call append_text(lines, placing_line(scene, model, t))
    end do
  end function source_lines

  !> How far a tool was moved to its place.
  function placing_line(scene, model, t) result(line)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    integer, intent(in) :: t
    character(:), allocatable :: line
    real(wp) :: shift(3)

    shift = model%bodies%tools(t)%surfaces(1)%points(1, 1, :) - &
            scene%tools(t)%surfaces(1)%points(1, 1, :)
    line = "tool "//scene%tools(t)%name//" placed: moved by "//place_text(shift)//", clearance "// &
           rounded_text(scene%tools(t)%clearance)
  end function placing_line

end module source_report
