!> Where the surfaces of tools come from, for the log and for --check.
module source_report
  use scene, only: scene_t
  use text, only: string_t
  implicit none
  private

  public :: source_lines

contains

  !> One line for each note on a tool, the tool's name before the first.
  function source_lines(scene) result(lines)
    type(scene_t), intent(in) :: scene
    type(string_t), allocatable :: lines(:)
    type(string_t) :: line
    integer :: t, i

    allocate (lines(0))
    do t = 1, size(scene%tools)
      if (.not. allocated(scene%tools(t)%notes)) cycle
      do i = 1, size(scene%tools(t)%notes)
        line%value = "  "//scene%tools(t)%notes(i)%value
        if (i == 1) line%value = "tool "//scene%tools(t)%name//" from "// &
                                 scene%tools(t)%notes(i)%value
        lines = [lines, line]
      end do
    end do
  end function source_lines

end module source_report
