!> Where points of rigid tools are in a frame.
module tool_places
  use kinds, only: wp
  implicit none
  private

  public :: carried

contains

  !> A vector for each tool, and a matrix times the place where some turn, at points of the tools:
  !! with the displacement of its frame and its rotation less one, how far each point has come.
  pure function carried(points, tool_of_point, vectors, matrices) result(values)
    real(wp), intent(in) :: points(:, :)                  !! at the start, (n, 3) [length]
    integer, intent(in) :: tool_of_point(:)
    real(wp), intent(in) :: vectors(:, :)                 !! (3, tools)
    real(wp), intent(in), optional :: matrices(:, :, :)   !! (3, 3, tools)
    real(wp) :: values(size(points, 1), 3)
    integer :: i

    values = transpose(vectors(:, tool_of_point))
    if (.not. present(matrices)) return
    do i = 1, size(tool_of_point)
      values(i, :) = values(i, :) + matmul(matrices(:, :, tool_of_point(i)), points(i, :))
    end do
  end function carried

end module tool_places
